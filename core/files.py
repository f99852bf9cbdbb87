"""Files written whole or not at all, JSON and TOML read back checked, and checksums."""

import errno
import hashlib
import json
import os
import re
import secrets
import tomllib
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from core.errors import DiskFullError, InputError, StoreError

MAX_JSON = 64 << 20
"""The largest JSON file that is read [bytes]; a run of 2 h has some 2 MB."""

SUM_SUFFIX = ".sha256"

_SHORT_LINE = 100
_ROW_LINE = 480

_TEMPORARY = re.compile(r"\..+\.[0-9a-f]{8}\.tmp")
_FULL = (errno.ENOSPC, errno.EDQUOT)


@contextmanager
def whole_file(path: Path) -> Iterator[Path]:
    """Give a temporary name beside ``path`` to write to; it takes the name when all went well.

    What is at ``path`` stays untouched until the new file is complete and on the disk. Raises
    `StoreError` if the file system refuses.
    """
    temporary = path.with_name(f".{path.name}.{secrets.token_hex(4)}.tmp")
    try:
        yield temporary
        with temporary.open("rb") as file:
            os.fsync(file.fileno())
        temporary.replace(path)
    except OSError as error:
        raise write_error(path.parent, error) from error
    finally:
        with suppress(OSError):
            temporary.unlink(missing_ok=True)


def is_temporary(name: str) -> bool:
    """Whether `whole_file` gives such names: who finds one later knows that its writer died.

    >>> is_temporary(".run.parquet.0f3a77b2.tmp"), is_temporary("run.parquet")
    (True, False)
    """
    return _TEMPORARY.fullmatch(name) is not None


def write_error(folder: Path, error: OSError) -> StoreError:
    """The `StoreError` for a folder that cannot be written to: what is wrong and what to do."""
    reason = error.strerror or str(error)
    kind = DiskFullError if error.errno in _FULL else StoreError
    return kind(
        f"cannot write to {folder}: {reason}. Nothing stored was changed. "
        "Free space or allow writing there, or choose another folder and try again."
    )


def write_json(path: Path, values: dict[str, Any]) -> None:
    """Write ``values`` as `readable_json`, whole or not at all; raises `StoreError`."""
    with whole_file(path) as temporary:
        temporary.write_text(readable_json(values), encoding="utf-8")


def readable_json(values: Any) -> str:
    """Indented JSON with each list or table of single values on one line, as long as they may be.

    A row of a matrix, and a row of results, is then a line: people can read the file, and what
    changes in it shows. Raises ``ValueError`` for numbers that are not finite.
    """
    return _readable(values, "") + "\n"


def _readable(value: Any, indent: str) -> str:
    if not isinstance(value, dict | list | tuple) or not value:
        return _one_line(value)
    items = list(value.values()) if isinstance(value, dict) else value
    is_flat = not any(isinstance(item, dict | list | tuple) and item for item in items)
    if is_flat and (indent or len(_one_line(value)) <= _SHORT_LINE):
        return _one_line(value)
    inner = indent + " "
    if isinstance(value, dict):
        parts = [
            f"{_one_line(str(name))}: {_readable(each, inner)}" for name, each in value.items()
        ]
        opening, closing = "{", "}"
    else:
        lines = [_one_line(each) for each in value]
        parts = [
            line if len(line) <= _ROW_LINE else _readable(each, inner)
            for line, each in zip(lines, value, strict=True)
        ]
        opening, closing = "[", "]"
    separator = f",\n{inner}"
    return f"{opening}\n{inner}{separator.join(parts)}\n{indent}{closing}"


def _one_line(value: Any) -> str:
    return json.dumps(value, ensure_ascii=False, allow_nan=False)


def read_json(path: Path) -> dict[str, Any]:
    """Read what `write_json` wrote; raises `StoreError` if it is not there or not JSON."""
    try:
        if (size := path.stat().st_size) > MAX_JSON:
            raise StoreError(f"{path} has {size >> 20} MB: more than any that MirrorTwin writes")
        values: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise StoreError(f"cannot read {path}: {error.strerror}") from error
    except (ValueError, RecursionError) as error:
        raise StoreError(f"{path} is damaged: {error}") from error
    if not isinstance(values, dict):
        raise StoreError(f"{path} is damaged: it holds no table of values")
    return values


def read_toml(path: Path, what: str) -> dict[str, Any]:
    """Read a TOML file; raises `InputError` naming ``what`` if it is not there or not TOML."""
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise InputError(what, f"cannot read {path}: {error.strerror}") from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise InputError(what, f"{path} is not TOML: {error}") from None


def sealed(values: dict[str, Any]) -> dict[str, Any]:
    """The values with a checksum of theirs, for `check_seal` to find what a bit has changed in."""
    rest = {name: value for name, value in values.items() if name != "sha256"}
    text = json.dumps(rest, separators=(",", ":"), sort_keys=True)
    return rest | {"sha256": hashlib.sha256(text.encode()).hexdigest()}


def check_seal(path: Path, values: dict[str, Any]) -> None:
    """Raise `StoreError` if values read from ``path`` are not those that were `sealed`.

    Values without a seal, of an earlier version, pass.
    """
    if "sha256" in values and sealed(values)["sha256"] != values["sha256"]:
        raise StoreError(f"{path} is damaged (checksum); fly it again")


def write_sum(path: Path) -> None:
    """Keep a file's checksum beside it, as ``sha256sum -c`` reads it; raises `StoreError`."""
    beside = path.with_name(path.name + SUM_SUFFIX)
    with whole_file(beside) as temporary:
        temporary.write_text(f"{file_sum(path)}  {path.name}\n", encoding="utf-8")


def has_its_sum(path: Path) -> bool:
    """Whether a file is as it was when `write_sum` was called; so is one of an earlier version."""
    beside = path.with_name(path.name + SUM_SUFFIX)
    try:
        return beside.read_text(encoding="utf-8").split()[:1] == [file_sum(path)]
    except FileNotFoundError:
        return path.exists()
    except (OSError, UnicodeDecodeError):
        return False


def file_sum(path: Path) -> str:
    """The SHA-256 of a file; may raise `OSError`."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
