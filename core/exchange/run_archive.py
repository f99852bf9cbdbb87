"""Runs to take along: one zip file with all that is kept of them, checked when it is unpacked.

    manifest.json         what this is: checksums (SHA-256) of all files, tags and notes
    <run>/run.json        record, diagnosis and report, byte for byte as stored
    <run>/run.parquet     both flights, likewise
    <run>/run.rrd         the Rerun recording, if there is one
    <run>/report.html     the report to read, likewise .md; left behind when a run is unpacked

What is unpacked may come from anywhere. So no name in it becomes a path: files are looked for under
the names that a run's files have, and anything else is refused. Sizes are bounded before a byte is
read, and a run is entered only when every part of it can be read as what it should be.
"""

import hashlib
import json
import shutil
import struct
import tempfile
import threading
import zipfile
import zlib
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any, TypeVar

import numpy as np

from core.errors import InputError, StoreError
from core.exchange.foreign_flight import check_flight, check_pages
from core.exchange.report_file import report_file, stored_report
from core.files import check_seal, read_json, whole_file, write_error, write_sum
from core.report.files.export import Exported, to_markdown
from core.store.labels import Label, label_of
from core.store.records import RunRecord, read_record, valid_run_id
from core.store.recovery import IMPORT_PREFIX, read_label_file, write_label_file
from core.store.result_file import read_result
from core.store.rows import NO_LABEL
from core.store.store import RunStore
from core.twin.flight_file import read_pair

FORMAT = "mirrortwin-runs"
VERSION = 1
MANIFEST = "manifest.json"
FILES = ("run.json", "run.parquet", "run.rrd")
REPORTS = ("report.html", "report.md")

MAX_PACKED_RUNS = 50
MAX_PACKED = 512 << 20
"""The largest zip file that is taken [bytes]; a run of 300 s has some 15 MB, one of 2 h 200 MB."""

MAX_UNPACKED = 2 * MAX_PACKED
MAX_TEXT = 16 << 20
_MAX_DIRECTORY = 1 << 20
_BLOCK = 1 << 20
_EPOCH = (1980, 1, 1, 0, 0, 0)
_END = struct.Struct("<4s4H2LH")
_FIELD = "file"
_Made = TypeVar("_Made")
_one_at_a_time = threading.Lock()


def pack(store: RunStore, run_ids: Sequence[str], path: Path) -> None:
    """Write these finished runs to ``path``, whole or not at all.

    Raises `InputError` for a run that is not done or too many of them, or `StoreError`.
    """
    if not 0 < len(run_ids) <= MAX_PACKED_RUNS:
        raise InputError("runs", f"must be 1 to {MAX_PACKED_RUNS} at once, got {len(run_ids)}")
    for run_id in run_ids:
        if (status := store.get(run_id).status) != "done":
            raise InputError("run", f"{run_id} is {status}: only a finished run can be exported")
    with whole_file(path) as temporary, zipfile.ZipFile(temporary, "w") as archive:
        runs = {run_id: _packed(store, run_id, archive) for run_id in dict.fromkeys(run_ids)}
        content = {"format": FORMAT, "version": VERSION, "runs": runs}
        _add(archive, MANIFEST, json.dumps(content, indent=1).encode())


def _packed(store: RunStore, run_id: str, archive: zipfile.ZipFile) -> dict[str, Any]:
    """Add a run's files; returns what the manifest says of it."""
    folder = store.recording_path(run_id).parent
    sums = {}
    for name in FILES:
        if (folder / name).exists():
            sums[name] = _add_file(archive, f"{run_id}/{name}", folder / name)
    report = stored_report(store, run_id)
    for name in REPORTS:
        content = report_file(report, name.rpartition(".")[2])
        sums[name] = _add(archive, f"{run_id}/{name}", content)
    label = label_of(store, run_id)
    return {"tags": list(label.tags), "note": label.note, "sha256": sums}


def _add(archive: zipfile.ZipFile, name: str, content: bytes) -> str:
    entry = zipfile.ZipInfo(name, _EPOCH)
    entry.compress_type = zipfile.ZIP_DEFLATED
    archive.writestr(entry, content)
    return hashlib.sha256(content).hexdigest()


def _add_file(archive: zipfile.ZipFile, name: str, path: Path) -> str:
    """Add a file; Parquet and recordings as they are, for they are compressed already."""
    digest = hashlib.sha256()
    entry = zipfile.ZipInfo(name, _EPOCH)
    entry.compress_type = zipfile.ZIP_DEFLATED if name.endswith(".json") else zipfile.ZIP_STORED
    with path.open("rb") as source, archive.open(entry, "w") as target:
        while block := source.read(_BLOCK):
            digest.update(block)
            target.write(block)
    return digest.hexdigest()


def unpack(store: RunStore, path: Path) -> list[RunRecord]:
    """Enter the runs of an archive into the store, all or none, each under its own name.

    A run of the archive that was thrown away here comes back as the archive has it. Raises
    `InputError` saying what is wrong with the file, or `StoreError`.
    """
    with _one_at_a_time, _opened(path) as archive:
        offered = _manifest(archive)
        here = [run_id for run_id in offered if _is_here(store, run_id)]
        if here:
            raise InputError(_FIELD, f"holds run {here[0]}, which is in this store already")
        with _workplace(store) as workplace:
            items = offered.values()
            found = _with_room(
                store, lambda: [_unpacked(archive, item, workplace / item.run_id) for item in items]
            )
            _with_room(store, lambda: _enter(store, found, workplace))
    return found


@dataclass(frozen=True, slots=True)
class _Offered:
    """What a manifest says of a run."""

    run_id: str
    label: Label
    sums: dict[str, str]


def _is_here(store: RunStore, run_id: str) -> bool:
    try:
        store.get(run_id)
    except StoreError:
        return False
    return True


@contextmanager
def _opened(path: Path) -> Iterator[zipfile.ZipFile]:
    """The zip file, if its size, its directory and what it says of its content are acceptable."""
    try:
        if path.stat().st_size > MAX_PACKED:
            raise InputError(_FIELD, f"is larger than {MAX_PACKED >> 20} MB")
        with path.open("rb") as file:
            _check_directory(file)
            with zipfile.ZipFile(file) as archive:
                _check_entries(archive.infolist())
                yield archive
    except (zipfile.BadZipFile, zlib.error, UnicodeDecodeError) as error:
        raise InputError(_FIELD, f"is damaged: {error}") from None
    except (NotImplementedError, RuntimeError, EOFError) as error:
        raise InputError(_FIELD, f"cannot be unpacked: {error}") from None
    except OSError as error:
        raise InputError(_FIELD, f"cannot be read: {error.strerror or error}") from None


def _check_directory(file: IO[bytes]) -> None:
    """Refuse what is no zip file, or one whose directory alone would fill the memory.

    Python reads the whole directory before it says anything, and believes a ZIP64 record, which no
    archive needs.
    """
    size = file.seek(0, 2)
    file.seek(max(0, size - _END.size - 20))
    tail = file.read()
    if size < _END.size + 20 or tail[20:24] != b"PK\5\6":
        raise InputError(_FIELD, "is not a zip file that MirrorTwin wrote, or it was cut short")
    directory_bytes = _END.unpack(tail[20:])[5]
    if tail[:4] == b"PK\6\7" or directory_bytes > _MAX_DIRECTORY:
        raise InputError(_FIELD, "lists more files than an export has")


def _check_entries(entries: Sequence[zipfile.ZipInfo]) -> None:
    if len(entries) > MAX_PACKED_RUNS * len((*FILES, *REPORTS)) + 1:
        raise InputError(_FIELD, "lists more files than an export has")
    names: set[str] = set()
    for entry in entries:
        folder, _, name = entry.filename.rpartition("/")
        known = name in (*FILES, *REPORTS) and valid_run_id(folder)
        if not known and entry.filename != MANIFEST:
            raise InputError(
                _FIELD, f"holds {entry.filename!r:.80}, which no export of MirrorTwin does"
            )
        if entry.filename in names:
            raise InputError(_FIELD, f"holds {entry.filename} twice")
        names.add(entry.filename)
        if entry.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):
            raise InputError(_FIELD, f"packs {entry.filename} in a way that exports do not")
        if name.endswith((".json", ".md", ".html")) and entry.file_size > MAX_TEXT:
            raise InputError(_FIELD, f"holds {entry.filename} of {entry.file_size >> 20} MB")
    if sum(entry.file_size for entry in entries) > MAX_UNPACKED:
        raise InputError(_FIELD, f"would unpack to more than {MAX_UNPACKED >> 20} MB")


def _manifest(archive: zipfile.ZipFile) -> dict[str, _Offered]:
    """What the archive says it holds; raises `InputError`."""
    if MANIFEST not in archive.namelist():
        raise InputError(_FIELD, f"has no {MANIFEST}: it is not an export of MirrorTwin")
    try:
        content = json.loads(archive.read(MANIFEST))
        if content["format"] != FORMAT:
            raise InputError(_FIELD, "is not an export of MirrorTwin")
        if content["version"] != VERSION:
            raise InputError(_FIELD, f"is of format {content['version']!r:.20}, not {VERSION}")
        offered = {
            run_id: _Offered(run_id, Label(tuple(said["tags"]), said["note"]), said["sha256"])
            for run_id, said in content["runs"].items()
        }
        complete = all({"run.json", "run.parquet"} <= item.sums.keys() for item in offered.values())
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError):
        raise InputError(_FIELD, f"has a {MANIFEST} that cannot be read") from None
    except InputError as error:
        if error.field == _FIELD:
            raise
        raise InputError(_FIELD, f"has a {MANIFEST} with bad {error}") from None
    if not 0 < len(offered) <= MAX_PACKED_RUNS:
        raise InputError(_FIELD, f"must hold 1 to {MAX_PACKED_RUNS} runs, got {len(offered)}")
    listed = {f"{item.run_id}/{name}" for item in offered.values() for name in item.sums}
    if not complete or listed | {MANIFEST} != set(archive.namelist()):
        raise InputError(_FIELD, f"does not hold the files that its {MANIFEST} lists")
    return offered


@contextmanager
def _workplace(store: RunStore) -> Iterator[Path]:
    """A folder beside the runs, gone in the end."""
    try:
        with tempfile.TemporaryDirectory(prefix=IMPORT_PREFIX, dir=store.root / "runs") as folder:
            yield Path(folder)
    except OSError as error:
        raise write_error(store.root, error) from error


def _with_room(store: RunStore, act: Callable[[], _Made]) -> _Made:
    """What ``act`` returns, with a full disk as the error that `RunStore.with_room` knows."""

    def translated() -> _Made:
        try:
            return act()
        except OSError as error:
            raise write_error(store.root, error) from error

    return store.with_room(translated)


def _unpacked(archive: zipfile.ZipFile, offered: _Offered, folder: Path) -> RunRecord:
    """Write a run's files to ``folder``, read each of them, and return the run's record."""
    shutil.rmtree(folder, ignore_errors=True)  # of a first try that the disk had no room for
    folder.mkdir()
    for name in FILES:
        if name not in offered.sums:
            continue
        entry = f"{offered.run_id}/{name}"
        digest = hashlib.sha256()
        with archive.open(entry) as source, (folder / name).open("wb") as target:
            while block := source.read(_BLOCK):
                digest.update(block)
                target.write(block)
        if digest.hexdigest() != offered.sums[name]:
            raise InputError(_FIELD, f"holds a {entry} that was changed: its checksum is wrong")
    try:
        record = _checked(offered.run_id, folder)
    except InputError as error:
        raise InputError(_FIELD, f"holds a run {offered.run_id} with a bad {error}") from None
    except StoreError as error:
        reason = str(error).replace(f"{folder}/", "")
        raise InputError(_FIELD, f"holds a run {offered.run_id} of which {reason}") from None
    if (folder / "run.rrd").exists():
        write_sum(folder / "run.rrd")
    write_label_file(folder, {**NO_LABEL, "tags": json.dumps(offered.label.tags),
                              "note": offered.label.note})  # fmt: skip
    return record


def _checked(run_id: str, folder: Path) -> RunRecord:
    """The record of a run whose files are all what they should be; raises a `MirrorTwinError`."""
    path = folder / "run.json"
    values = read_json(path)
    try:
        # What JSON can hold and no file, index or page of ours: half characters, not-a-numbers.
        json.dumps(values, ensure_ascii=False, allow_nan=False).encode()
        check_seal(path, values)
        record = read_record(values["record"])
        diagnosis, report = read_result(path)
    except ValueError:
        raise InputError(path.name, "holds text or numbers that cannot be kept") from None
    except (KeyError, TypeError, AttributeError, IndexError, RecursionError, OverflowError):
        raise InputError(path.name, "is not the record of a run") from None
    if record.id != run_id or record.status != "done":
        raise InputError(path.name, f"tells of {record.id}, {record.status}")
    if record.top != diagnosis.top or not np.isfinite(diagnosis.probabilities).all():
        raise InputError(path.name, "gives another verdict than its diagnosis")
    parquet = folder / "run.parquet"
    check_pages(parquet)
    pair = read_pair(parquet)
    if not 1 <= len(pair.mirror) <= record.plan.n_steps:
        raise InputError(parquet.name, f"has {len(pair.mirror)} samples, and its plan is "
                         f"{record.plan.duration_s:g} s long")  # fmt: skip
    for flight in (pair.faulted, pair.mirror):
        check_flight(parquet.name, flight)
    try:
        # Whatever is wrong in it comes out here.
        to_markdown(Exported({}, diagnosis, report, pair)).encode()
    except (KeyError, TypeError, ValueError, AttributeError, IndexError, OverflowError):
        raise InputError(path.name, "holds a report that cannot be shown") from None
    recording = folder / "run.rrd"
    if recording.exists():
        with recording.open("rb") as file:
            if file.read(4) != b"RRF2":
                raise InputError("run.rrd", "is not a recording")
    return record


def _enter(store: RunStore, records: Sequence[RunRecord], workplace: Path) -> None:
    """Put what was checked in its place; takes it back, whatever happens.

    A run of that name that was thrown away here waits meanwhile in the workplace.
    """
    runs = store.root / "runs"
    moved: list[str] = []
    waiting = workplace / "before"
    try:
        waiting.mkdir(exist_ok=True)
        for record in records:
            with suppress(FileNotFoundError):
                (runs / record.id).replace(waiting / record.id)
            moved.append(record.id)
            (workplace / record.id).replace(runs / record.id)
        labels = {record.id: read_label_file(runs / record.id) or NO_LABEL for record in records}
        store.enter(records, labels)
    except BaseException:
        for run_id in moved:
            with suppress(FileNotFoundError):
                (runs / run_id).replace(workplace / run_id)
            with suppress(FileNotFoundError):
                (waiting / run_id).replace(runs / run_id)
        raise
