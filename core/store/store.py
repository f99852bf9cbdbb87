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

import logging
import os
import sqlite3
import weakref
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from core.diagnosis.diagnosis import Diagnosis
from core.errors import DiskFullError, NoSuchRunError, StoreError
from core.files import (
    has_its_sum,
    write_error,
    write_sum,
)
from core.fmea.fault import Fault
from core.report.grounded import GroundedReport
from core.store import locks, recovery, rows
from core.store.index import HOME_VARIABLE, Index
from core.store.records import (
    STATUSES,
    UNFINISHED,
    RunRecord,
    code_version,
    new_run_id,
    valid_run_id,
)
from core.store.result_file import read_result, remove_files, replace_report, write_result
from core.twin.actions import Action
from core.twin.flight_file import (
    read_channels,
    read_columns,
    read_pair,
    write_pair,
)
from core.twin.plan import Plan
from core.twin.trajectory import Pair

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
        with suppress(OSError):  # said by what comes next
            self.root.mkdir(parents=True, exist_ok=True)
        share, is_alone = locks.share(self.root)
        self._let_go = weakref.finalize(self, locks.close, share)
        try:
            self.index = Index(self.root)
            self._recover(is_alone)
        except BaseException:
            self._let_go()
            raise
        if is_alone:
            locks.admit_others(share)

    @property
    def read_only_reason(self) -> str | None:
        """Why nothing can be stored, else None."""
        return self.index.read_only_reason

    def close(self) -> None:
        """Close the index; the store cannot be used afterwards."""
        with self.index.lock:
            self.index.close()
            self._let_go()

    def check_place(self) -> None:
        """Raise `StoreError` if the folder was removed or replaced since it was opened."""
        self.index.check_place()

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
        with self.index.writing() as connection:
            for record in records:
                rows.forget(connection, record.id)
                rows.insert(connection, record)
            for run_id, label in (labels or {}).items():
                if label != rows.NO_LABEL:
                    rows.insert_label(connection, run_id, label)

    def save_actions(self, run_id: str, actions: Iterable[Action]) -> None:
        """Keep what is done during a flight, in the place of what was kept before."""
        listed = tuple(actions)

        def write() -> None:
            with self.index.writing() as connection:
                rows.write_actions(connection, run_id, listed)

        self.with_room(write)

    def update(self, run_id: str, **changes: Any) -> RunRecord:
        """Change fields of a record (status, error, top, top_probability, attempts)."""
        if not changes or not changes.keys() <= _CHANGEABLE:
            raise ValueError(f"cannot change {', '.join(changes) or 'nothing'}")
        if changes.get("status", "queued") not in STATUSES:
            raise ValueError(f"no status {changes['status']!r}")
        assignments = ", ".join(f"{name} = :{name}" for name in changes)

        def write() -> None:
            with self.index.writing() as connection:
                connection.execute(
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
        with self.index.writing() as connection:
            left = connection.execute(
                "UPDATE runs SET status = 'failed', error = ? WHERE status IN (?, ?) RETURNING id",
                (SERVER_STOPPED, *UNFINISHED),
            ).fetchall()
        return [row["id"] for row in left]

    # -- room ------------------------------------------------------------------------------------

    def delete(self, run_ids: Sequence[str]) -> None:
        """Delete runs, files, rows and labels, beyond undoing; ``run_ids`` are valid names.

        The files first: on a full disk the index takes nothing before there is room. A run whose
        row is still there when this is broken off is deleted the next time.
        """
        with self.index.lock:
            self.check_place()
            for run_id in run_ids:
                remove_files(self.root, run_id)
            with self.index.writing() as connection:
                for run_id in run_ids:
                    rows.forget(connection, run_id)

    def purge(self, before: str = "9") -> list[str]:
        """Delete the runs that were thrown away ``before`` then (ISO 8601, UTC).

        Returns their names; by default all of them.
        """
        found = self.index.query("SELECT run FROM labels WHERE discarded <= ?", before)
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
        logger.warning("the disk is full: %d runs thrown away are deleted", len(purged))
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
        path = self._folder(run_id, make=True) / "run.json"
        self.with_room(lambda: write_result(path, done, diagnosis, report))
        return self.update(run_id, status="done", error=None, top=top, top_probability=probability)

    def save_report(self, run_id: str, report: GroundedReport) -> None:
        """Keep another report on a run that is done, in the place of the last one."""
        path = self._file(run_id, "run.json")
        with self.index.lock:
            self.with_room(lambda: replace_report(path, report))

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
            with self.index.writing() as connection:
                rows.insert_label(connection, run_id, row)

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
        return self.index.query(
            f"SELECT {', '.join(rows.COLUMNS)}, {_ACTIONS} FROM runs {clause}", *values
        )

    # -- recovery --------------------------------------------------------------------------------

    def _recover(self, is_alone: bool) -> None:
        """Enter runs that the index has lost; clear what killed processes left, if none is left."""
        index, can_write = self.index, self.read_only_reason is None
        known = {row["id"] for row in index.query("SELECT id FROM runs")}
        # Beside other processes, a run without a row may be one that is just being imported.
        if (can_write or index.is_in_memory) and (is_alone or not known):
            recovery.adopt(index.connection, self.root, known, index.set_aside)
        if is_alone and can_write:
            recovery.sweep(self.root)
            unfinished = self._select("WHERE status IN (?, ?)", *UNFINISHED)
            recovery.complete(index.connection, self.root, rows.readable(unfinished))
