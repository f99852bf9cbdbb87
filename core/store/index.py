"""The index of a run store: its tables, and how it is opened whatever state it is in.

A damaged index is set aside under another name, never deleted, and a new one takes its place, which
`core.store.recovery` fills from the run folders.
"""

import errno
import logging
import os
import sqlite3
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from core.errors import DiskFullError, StoreError

logger = logging.getLogger(__name__)

HOME_VARIABLE = "MIRRORTWIN_HOME"
"""The environment variable that names the folder of the run store."""

SCHEMA_VERSION = 3
BUSY_TIMEOUT_S = 5.0
FULL = ("SQLITE_FULL", "SQLITE_IOERR_SHMSIZE")
"""The names of SQLite's errors that mean a full disk."""

_DAMAGED = ("SQLITE_NOTADB", "SQLITE_CORRUPT")
_SCHEMA = """
CREATE TABLE IF NOT EXISTS runs (
    id TEXT PRIMARY KEY, created TEXT NOT NULL, status TEXT NOT NULL, plan TEXT NOT NULL,
    fault TEXT NOT NULL, error TEXT, code_version TEXT NOT NULL, top TEXT,
    top_probability REAL, attempts INTEGER NOT NULL
);
CREATE INDEX IF NOT EXISTS runs_created ON runs (created);
CREATE TABLE IF NOT EXISTS labels (
    run TEXT PRIMARY KEY, tags TEXT NOT NULL DEFAULT '[]', note TEXT NOT NULL DEFAULT '',
    discarded TEXT
);
CREATE TABLE IF NOT EXISTS actions (run TEXT PRIMARY KEY, listed TEXT NOT NULL);
"""


@dataclass(frozen=True)
class Opened:
    """An open index.

    ``read_only_reason``: why it cannot be written to, else None; ``is_full``: because the disk is
    full. ``set_aside``: where the damaged one is that it replaces.
    """

    connection: sqlite3.Connection
    read_only_reason: str | None = None
    is_full: bool = False
    set_aside: Path | None = None


def index_path(root: Path) -> Path:
    """Where a store's index is."""
    return root / "index.sqlite"


def identity(root: Path) -> tuple[int, int] | None:
    """Which file the index of a store is at this moment, whatever its name; None without one."""
    try:
        found = index_path(root).stat()
    except OSError:
        return None
    return found.st_dev, found.st_ino


def open_index(root: Path) -> Opened:
    """The index of a store, made if need be, or a readable one; raises `StoreError`."""
    path, is_full = index_path(root), False
    try:
        (root / "runs").mkdir(parents=True, exist_ok=True)
        if not os.access(root, os.W_OK):
            raise PermissionError(errno.EACCES, "read-only folder")
        try:
            return Opened(_writable_index(path))
        except sqlite3.DatabaseError as error:
            if not _is_damage(error):
                raise
            aside = _set_aside(path)
            logger.warning("the run index %s was damaged (%s); it is now %s", path, error, aside)
            return Opened(_writable_index(path), set_aside=aside)
    except OSError as error:
        reason = error.strerror or str(error)
        is_full = error.errno in (errno.ENOSPC, errno.EDQUOT)
    except sqlite3.DatabaseError as error:
        reason, is_full = str(error), error.sqlite_errorname in FULL
    if root.exists() and not root.is_dir():
        raise StoreError(f"the run store {root} is a file, not a folder")
    return Opened(_readable_index(path), reason, is_full)


class Index:
    """The open index of a store: what reads it and writes it, and SQLite's errors in our words.

    Thread-safe by its ``lock``. ``set_aside``: where the damaged index is that this one replaces.
    """

    def __init__(self, root: Path) -> None:
        """Open it, writable if it can be (see `open_index`); raises `StoreError`."""
        self.root = root
        self.lock = threading.RLock()
        self.connection: sqlite3.Connection
        self.read_only_reason: str | None
        self._identity: tuple[int, int] | None
        self.set_aside = self._open().set_aside

    @property
    def is_in_memory(self) -> bool:
        """Whether there is no file that could be opened, so that it is gone with this process."""
        return self._identity is None

    def close(self) -> None:
        """Close it; it cannot be used afterwards."""
        self.connection.close()

    def query(self, query: str, *values: Any) -> list[sqlite3.Row]:
        """What a SELECT of the index finds."""
        try:
            with self.lock:
                self.check_place()
                return self.connection.execute(query, values).fetchall()
        except sqlite3.Error as error:
            raise StoreError(f"cannot read the run index in {self.root}: {error}") from error

    @contextmanager
    def writing(self) -> Iterator[sqlite3.Connection]:
        """A transaction of the index."""
        with self.lock:
            self.check_place()
            if self.read_only_reason is not None:
                self._try_writable()
            try:
                with self.connection:
                    yield self.connection
            except sqlite3.Error as error:
                if "readonly" in str(error):  # the connection stays so: open another next time
                    self.read_only_reason = str(error)
                raise _write_error(
                    self.root, str(error), is_full=getattr(error, "sqlite_errorname", "") in FULL
                ) from error

    def _open(self) -> Opened:
        opened = open_index(self.root)
        self.connection, self.read_only_reason = opened.connection, opened.read_only_reason
        is_a_file = bool(self.connection.execute("PRAGMA database_list").fetchone()["file"])
        self._identity = identity(self.root) if is_a_file else None
        return opened

    def _try_writable(self) -> None:
        """Leave read-only mode if the folder can be written to by now; raises `StoreError`."""
        self.connection.close()  # first: SQLite shares a read-only memory map with new connections
        opened = self._open()
        if self.read_only_reason is not None:
            raise _write_error(self.root, self.read_only_reason, is_full=opened.is_full)

    def check_place(self) -> None:
        """Raise `StoreError` if the open index is no longer the file at its path.

        What is written to a file that was removed is lost without a word.
        """
        if self._identity is not None and identity(self.root) != self._identity:
            raise StoreError(
                f"the run store {self.root} was removed or replaced while it was open here: "
                "nothing is read from it or stored in it any more. Put it back where it was, or "
                "restart MirrorTwin to go on with what is there now"
            )


def _write_error(root: Path, reason: str, *, is_full: bool) -> StoreError:
    return (DiskFullError if is_full else StoreError)(
        f"cannot write to the run store {root}: {reason}. What is stored is safe. Free space or "
        f"allow writing there, or start with another folder in {HOME_VARIABLE}."
    )


def connect(uri: str) -> sqlite3.Connection:
    """A connection as this package wants it."""
    index = sqlite3.connect(uri, uri=True, timeout=BUSY_TIMEOUT_S, check_same_thread=False)
    index.row_factory = sqlite3.Row
    return index


def _writable_index(path: Path) -> sqlite3.Connection:
    index = connect(path.as_uri())
    try:
        # Not quick_check: it would not see that a lookup by name misses what a list shows.
        found = index.execute("PRAGMA integrity_check(1)").fetchone()[0]
        if found != "ok":
            raise _damage(found)
        index.execute("PRAGMA journal_mode = WAL")
        # In WAL mode NORMAL can lose the last rows to a power cut, but never harm the index.
        index.execute("PRAGMA synchronous = NORMAL")
        version = index.execute("PRAGMA user_version").fetchone()[0]
        if version > SCHEMA_VERSION:
            raise StoreError(
                f"{path} was written by a newer MirrorTwin; use that one, or another folder"
            )
        if version < SCHEMA_VERSION:
            index.executescript(f"{_SCHEMA} PRAGMA user_version = {SCHEMA_VERSION};")
    except BaseException:
        index.close()
        raise
    return index


def _damage(found: str) -> sqlite3.DatabaseError:
    error = sqlite3.DatabaseError(found.replace("\n", " ")[:200])
    error.sqlite_errorname = "SQLITE_CORRUPT"
    return error


def _is_damage(error: sqlite3.DatabaseError) -> bool:
    return getattr(error, "sqlite_errorname", "").startswith(_DAMAGED)


def _set_aside(path: Path) -> Path:
    """Give a damaged index another name, with the two files that SQLite keeps beside it."""
    aside = path.with_name(f"{path.name}.damaged-{datetime.now(UTC):%Y%m%dT%H%M%S%f}")
    path.replace(aside)
    for suffix in ("-wal", "-shm"):
        with suppress(FileNotFoundError):
            path.with_name(path.name + suffix).replace(aside.with_name(aside.name + suffix))
    return aside


def _readable_index(path: Path) -> sqlite3.Connection:
    # immutable: without leave to write, SQLite cannot make the shared memory that WAL needs.
    for options in ("mode=ro", "mode=ro&immutable=1"):
        try:
            index = connect(f"{path.as_uri()}?{options}")
            if index.execute("PRAGMA integrity_check(1)").fetchone()[0] != "ok":
                continue
            index.execute("SELECT count(*) FROM runs")
            _add_missing_tables(index)
            return index
        except sqlite3.Error:
            continue
    if path.exists() and not os.access(path, os.R_OK):
        raise StoreError(f"cannot read {path}: is it yours to read?")
    # None, or a damaged one that cannot be replaced: the run folders fill an index in memory.
    index = connect("file::memory:")
    index.executescript(_SCHEMA)
    return index


def _add_missing_tables(index: sqlite3.Connection) -> None:
    """Empty ones, beside an index of an earlier version: it says nothing of what they are for."""
    for name, columns in (("labels", "run, tags, note, discarded"), ("actions", "run, listed")):
        if not index.execute("SELECT 1 FROM sqlite_master WHERE name = ?", (name,)).fetchone():
            index.execute(f"CREATE TEMP TABLE {name} ({columns})")
