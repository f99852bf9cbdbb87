"""The run store: an SQLite index and one folder of files a run; it outlives every process.

    index.sqlite            one row a run: `core.store.records.RunRecord`; and what people wrote on
                            it, or that they threw it away (`core.store.labels`)
    runs/<id>/run.parquet   both flights (`core.twin.flight_file.write_pair`)
    runs/<id>/run.json      the record, the diagnosis and the report, with a checksum
    runs/<id>/label.json    what people wrote on it, as in the index
    runs/<id>/run.rrd       the Rerun recording, written by the app; run.rrd.sha256, its checksum

SQLite in WAL mode is the index: readers never wait for the writer, several processes may share a
store, and a full disk or a kill leaves the last committed state. Files are written whole or not at
all, and before the row that speaks of them; they are deleted before it. An index that was lost is
made again from the files (`core.store.recovery`).
"""

import fcntl
import logging
import os
import sqlite3
import threading
import weakref
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from shutil import rmtree
from typing import Any, TypeVar

import numpy as np

from core.diagnosis.diagnosis import Diagnosis
from core.errors import DiskFullError, NoSuchRunError, StoreError
from core.files import (
    check_seal,
    has_its_sum,
    read_json,
    sealed,
    write_error,
    write_json,
    write_sum,
)
from core.fmea.fault import Fault
from core.report.grounded import GroundedReport
from core.store import recovery, rows
from core.store.index import FULL, Opened, identity, open_index
from core.store.records import (
    STATUSES,
    UNFINISHED,
    RunRecord,
    code_version,
    new_run_id,
    valid_run_id,
)
from core.twin.actions import Action
from core.twin.flight_file import (
    read_channels,
    read_columns,
    read_pair,
    write_pair,
)
from core.twin.plan import Plan
from core.twin.trajectory import Pair

HOME_VARIABLE = "MIRRORTWIN_HOME"

logger = logging.getLogger(__name__)

SERVER_STOPPED = "the server stopped during this run; press Run again"

_KEPT = "id NOT IN (SELECT run FROM labels WHERE discarded IS NOT NULL)"
_CHANGEABLE = frozenset(rows.COLUMNS) - {"id", "created", "plan", "fault", "code_version"}
_ACTIONS = "(SELECT listed FROM actions WHERE run = runs.id) AS actions"

_Made = TypeVar("_Made")


def default_root() -> Path:
    """The folder named by ``MIRRORTWIN_HOME``, else ``.mirrortwin`` in the current one."""
    return Path(os.environ.get(HOME_VARIABLE) or ".mirrortwin").resolve()


class RunStore:
    """All runs under one folder. Thread-safe; several processes may use the same folder.

    A folder that cannot be written to can still be read: then `create`, `update` and the ``save_``
    methods raise `StoreError`. Every method may raise `StoreError` if the file system fails, or if
    the folder was removed or replaced since it was opened. What needs room on a full disk takes it
    from the runs that were thrown away.
    """

    def __init__(self, root: Path) -> None:
        """Open the store at ``root``, making it if need be; raises `StoreError`.

        An index that was lost is made again, and if no other process has the store open, what
        killed ones left is cleared away. What was found is logged as a warning.
        """
        self.root = root.resolve()
        self._lock = threading.RLock()
        with suppress(OSError):  # said by what comes next
            self.root.mkdir(parents=True, exist_ok=True)
        share, is_alone = _share(self.root)
        self._let_go = weakref.finalize(self, _close, share)
        self._index: sqlite3.Connection
        self._identity: tuple[int, int] | None
        self.read_only_reason: str | None
        try:
            opened = self._open()
            self._recover(opened.set_aside, is_alone)
        except BaseException:
            self._let_go()
            raise
        if share is not None and is_alone:
            fcntl.flock(share, fcntl.LOCK_SH)

    def close(self) -> None:
        """Close the index; the store cannot be used afterwards."""
        with self._lock:
            self._index.close()
            self._let_go()

    # -- records ---------------------------------------------------------------------------------

    def create(self, plan: Plan, fault: Fault, actions: Iterable[Action] = ()) -> RunRecord:
        """Enter a new run, status queued."""
        record = RunRecord(
            id=new_run_id(),
            created=datetime.now(UTC).isoformat(timespec="microseconds"),
            status="queued",
            plan=plan,
            fault=fault,
            code_version=code_version(),
            actions=tuple(actions),
        )
        self.with_room(lambda: self.enter([record]))
        return record

    def enter(
        self, records: Sequence[RunRecord], labels: Mapping[str, Mapping[str, Any]] | None = None
    ) -> None:
        """Enter records made elsewhere and what is written on them, all or none.

        They take the place of rows of their names, if there are such of runs thrown away.
        """
        with self.writing() as index:
            for record in records:
                rows.forget(index, record.id)
                rows.insert(index, record)
            for run_id, label in (labels or {}).items():
                if label != rows.NO_LABEL:
                    rows.insert_label(index, run_id, label)

    def save_actions(self, run_id: str, actions: Iterable[Action]) -> None:
        """Keep what is done during a flight, in the place of what was kept before."""
        listed = tuple(actions)

        def write() -> None:
            with self.writing() as index:
                rows.write_actions(index, run_id, listed)

        self.with_room(write)

    def update(self, run_id: str, **changes: Any) -> RunRecord:
        """Change fields of a record (status, error, top, top_probability, attempts)."""
        if not changes or not changes.keys() <= _CHANGEABLE:
            raise ValueError(f"cannot change {', '.join(changes) or 'nothing'}")
        if changes.get("status", "queued") not in STATUSES:
            raise ValueError(f"no status {changes['status']!r}")
        assignments = ", ".join(f"{name} = :{name}" for name in changes)

        def write() -> None:
            with self.writing() as index:
                index.execute(
                    f"UPDATE runs SET {assignments} WHERE id = :id", {**changes, "id": run_id}
                )

        self.with_room(write)
        return self.get(run_id)

    def get(self, run_id: str) -> RunRecord:
        """The record of one run; raises `StoreError` if there is none, or none any more."""
        found = self._select(f"WHERE id = ? AND {_KEPT}", run_id)
        if not found:
            raise NoSuchRunError(f"no run {run_id[:40]!r} in {self.root}")
        return rows.record_of(found[0])

    def records(self) -> list[RunRecord]:
        """All records, newest first; those that this version cannot read are left out."""
        return list(rows.readable(self._select(f"WHERE {_KEPT} ORDER BY created DESC, rowid DESC")))

    def fail_unfinished(self) -> list[str]:
        """Mark what a stopped server left queued or running as failed; returns those runs.

        Only for a process that knows that no other one is flying (`core.jobs.engine`).
        """
        with self.writing() as index:
            left = index.execute(
                "UPDATE runs SET status = 'failed', error = ? WHERE status IN (?, ?) RETURNING id",
                (SERVER_STOPPED, *UNFINISHED),
            ).fetchall()
        return [row["id"] for row in left]

    # -- room ------------------------------------------------------------------------------------

    def delete(self, run_ids: Sequence[str]) -> None:
        """Delete runs for good, files, rows and labels; ``run_ids`` are valid names.

        The files first: on a full disk the index takes nothing before there is room. A run whose
        row is still there when this is broken off is deleted the next time.
        """
        with self._lock:
            self.check_place()
            for run_id in run_ids:
                _remove_files(self.root, run_id)
            with self.writing() as index:
                for run_id in run_ids:
                    rows.forget(index, run_id)

    def purge(self, before: str = "9") -> list[str]:
        """Delete for good the runs that were thrown away ``before`` then (ISO 8601, UTC).

        Returns their names; by default all of them.
        """
        found = self.query("SELECT run FROM labels WHERE discarded <= ?", before)
        run_ids = [row["run"] for row in found if valid_run_id(row["run"])]
        if run_ids:
            self.delete(run_ids)
        return run_ids

    def with_room(self, write: Callable[[], _Made]) -> _Made:
        """What ``write`` returns; on a full disk it is done again in the room of what was purged.

        Raises `DiskFullError` if nothing that was thrown away is left, or that is too little.
        """
        try:
            return write()
        except DiskFullError:
            purged = self.purge()
            if not purged:
                raise
        logger.warning("the disk is full: %d runs thrown away are deleted for good", len(purged))
        return write()

    # -- files -----------------------------------------------------------------------------------

    def save_pair(self, run_id: str, pair: Pair) -> None:
        """Keep both flights."""
        path = self._folder(run_id, make=True) / "run.parquet"
        self.with_room(lambda: write_pair(path, pair))

    def load_pair(self, run_id: str) -> Pair:
        """Both flights, bit for bit as saved."""
        return read_pair(self._file(run_id, "run.parquet"))

    def load_columns(self, run_id: str, names: Sequence[str]) -> dict[str, np.ndarray]:
        """Some columns of `load_pair`, such as ``mirror.E1 RPM``, each (n,)."""
        return read_columns(self._file(run_id, "run.parquet"), names)

    def load_channels(
        self, run_id: str, from_s: float, to_s: float
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Time (n,) and channels (n, 23) of faulted flight and mirror between two times."""
        return read_channels(self._file(run_id, "run.parquet"), from_s, to_s)

    def save_result(self, run_id: str, diagnosis: Diagnosis, report: GroundedReport) -> RunRecord:
        """Keep diagnosis and report, which completes the run: its status becomes done."""
        top, probability = diagnosis.ranked(1)[0]
        done = replace(
            self.get(run_id), status="done", error=None, top=top, top_probability=probability
        )
        values = {
            "record": done.to_dict(),
            "diagnosis": diagnosis.to_dict(),
            "report": report.to_dict(),
        }
        path = self._folder(run_id, make=True) / "run.json"
        self.with_room(lambda: write_json(path, sealed(values)))
        return self.update(run_id, status="done", error=None, top=top, top_probability=probability)

    def save_report(self, run_id: str, report: GroundedReport) -> None:
        """Keep another report on a run that is done, in the place of the last one."""
        path = self._file(run_id, "run.json")
        with self._lock:
            values = read_json(path)
            check_seal(path, values)
            whole = sealed(values | {"report": report.to_dict()})
            self.with_room(lambda: write_json(path, whole))

    def load_result(self, run_id: str) -> tuple[Diagnosis, GroundedReport]:
        """Diagnosis and report as saved."""
        return read_result(self._file(run_id, "run.json"))

    def recording_path(self, run_id: str) -> Path:
        """Where the run's ``.rrd`` is, or is to be written."""
        return self._folder(run_id) / "run.rrd"

    def save_recording(self, run_id: str, write: Callable[[Path], None]) -> None:
        """Have ``write`` write the recording to a path, and keep its checksum."""
        path = self._folder(run_id, make=True) / "run.rrd"

        def written() -> None:
            write(path)
            write_sum(path)

        self.with_room(written)

    def has_recording(self, run_id: str) -> bool:
        """Whether the run has a recording that is as it was written."""
        return has_its_sum(self.recording_path(run_id))

    def save_label(self, run_id: str, label: Mapping[str, Any]) -> None:
        """Keep a row of what people wrote on a run, beside the run too."""
        row = {**rows.NO_LABEL, **label}
        folder = self._place(run_id)

        def write() -> None:
            recovery.write_label_file(folder, row)
            with self.writing() as index:
                rows.insert_label(index, run_id, row)

        self.with_room(write)

    # -- inside ----------------------------------------------------------------------------------

    def _folder(self, run_id: str, *, make: bool = False) -> Path:
        self.get(run_id)  # only names that we gave ourselves ever become a path
        folder = self._place(run_id)
        if make:
            try:
                folder.mkdir(parents=True, exist_ok=True)
            except OSError as error:
                raise write_error(self.root, error) from error
        return folder

    def _place(self, run_id: str) -> Path:
        return self.root / "runs" / run_id

    def _file(self, run_id: str, name: str) -> Path:
        record = self.get(run_id)
        path = self._folder(run_id) / name
        if not path.exists():
            raise StoreError(f"run {run_id} is {record.status}: it has no {name}")
        return path

    def _select(self, clause: str, *values: Any) -> list[sqlite3.Row]:
        return self.query(
            f"SELECT {', '.join(rows.COLUMNS)}, {_ACTIONS} FROM runs {clause}", *values
        )

    def query(self, query: str, *values: Any) -> list[sqlite3.Row]:
        """What a SELECT of the index finds; for this package alone."""
        try:
            with self._lock:
                self.check_place()
                return self._index.execute(query, values).fetchall()
        except sqlite3.Error as error:
            raise StoreError(f"cannot read the run index in {self.root}: {error}") from error

    @contextmanager
    def writing(self) -> Iterator[sqlite3.Connection]:
        """A transaction of the index; for this package alone."""
        with self._lock:
            self.check_place()
            if self.read_only_reason is not None:
                self._try_writable()
            try:
                with self._index:
                    yield self._index
            except sqlite3.Error as error:
                if "readonly" in str(error):  # the connection stays so: open anew next time
                    self.read_only_reason = str(error)
                raise _index_error(self.root, str(error), is_full=_is_full(error)) from error

    def _open(self) -> Opened:
        opened = open_index(self.root)
        self._index, self.read_only_reason = opened.connection, opened.read_only_reason
        is_a_file = bool(self._index.execute("PRAGMA database_list").fetchone()["file"])
        self._identity = identity(self.root) if is_a_file else None
        return opened

    def _try_writable(self) -> None:
        """Leave read-only mode if the folder can be written to by now; raises `StoreError`."""
        self._index.close()  # first: SQLite shares a read-only memory map with new connections
        opened = self._open()
        if self.read_only_reason is not None:
            raise _index_error(self.root, self.read_only_reason, is_full=opened.is_full)

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

    # -- recovery --------------------------------------------------------------------------------

    def _recover(self, set_aside: Path | None, is_alone: bool) -> None:
        """Enter runs that the index has lost; clear what killed processes left, if none is left."""
        can_write = self.read_only_reason is None
        known = {row["id"] for row in self.query("SELECT id FROM runs")}
        # Beside other processes, a run without a row may be one that is just being imported.
        if (can_write or self._identity is None) and (is_alone or not known):
            recovery.adopt(self._index, self.root, known, set_aside)
        if is_alone and can_write:
            recovery.sweep(self.root)
            unfinished = self._select("WHERE status IN (?, ?)", *UNFINISHED)
            recovery.complete(self._index, self.root, rows.readable(unfinished))


def read_result(path: Path) -> tuple[Diagnosis, GroundedReport]:
    """Diagnosis and report in a ``run.json``; raises `StoreError`."""
    values = read_json(path)
    check_seal(path, values)
    try:
        diagnosis = Diagnosis.from_dict(values["diagnosis"])
        return diagnosis, GroundedReport.from_dict(values["report"])
    except (KeyError, TypeError, ValueError) as error:
        raise StoreError(f"{path} is not a result of this version: {error}") from error


def _remove_files(root: Path, run_id: str) -> None:
    folder = root / "runs" / run_id
    try:
        (folder / "run.json").unlink(missing_ok=True)  # first: nobody takes the rest for a run
    except OSError as error:
        raise write_error(root, error) from error
    rmtree(folder, ignore_errors=True)


def _is_full(error: sqlite3.Error) -> bool:
    return getattr(error, "sqlite_errorname", "") in FULL


def _index_error(root: Path, reason: str, *, is_full: bool) -> StoreError:
    return (DiskFullError if is_full else StoreError)(
        f"cannot write to the run store {root}: {reason}. What is stored is safe. Free space or "
        f"allow writing there, or start with another folder in {HOME_VARIABLE}."
    )


def _share(root: Path) -> tuple[int | None, bool]:
    """A share in a store's folder for as long as it is open here, and whether it is the only one.

    One that is the only one is exclusive, until it is made less: who comes then waits.
    """
    try:
        share = os.open(root, os.O_RDONLY | os.O_DIRECTORY)
    except OSError:
        return None, False
    try:
        try:
            fcntl.flock(share, fcntl.LOCK_EX | fcntl.LOCK_NB)
            return share, True
        except BlockingIOError:
            fcntl.flock(share, fcntl.LOCK_SH)
            return share, False
    except OSError:  # a file system without locks
        os.close(share)
        return None, False


def _close(share: int | None) -> None:
    if share is not None:
        os.close(share)
