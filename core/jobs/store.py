"""The run store: an SQLite index and one folder of files a run; it outlives every process.

    index.sqlite            one row a run: `core.jobs.records.RunRecord`; and what people wrote on
                            it, or that they threw it away (`core.jobs.keeping`)
    runs/<id>/run.parquet   both flights (`core.jobs.files.write_pair`)
    runs/<id>/run.json      the record, the diagnosis and the report
    runs/<id>/run.rrd       the Rerun recording, written by the app

SQLite in WAL mode is the index: readers never wait for the writer, several processes may share a
store, and a full disk or a kill leaves the last committed state. Files are written whole or not at
all, and before the row that speaks of them.
"""

import errno
import json
import logging
import os
import sqlite3
import threading
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import fields, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np

from core.diagnosis.diagnosis import Diagnosis
from core.errors import InputError, StoreError
from core.fmea.fault import Fault
from core.jobs.files import (
    read_channels,
    read_columns,
    read_json,
    read_pair,
    read_trajectory,
    write_error,
    write_json,
    write_pair,
    write_trajectory,
)
from core.jobs.records import STATUSES, UNFINISHED, RunRecord, code_version, new_run_id
from core.report.case import open_case
from core.report.grounded import GroundedReport, checked_report
from core.report.report import Report
from core.twin.actions import Action, action_to_dict, read_action
from core.twin.plan import Plan
from core.twin.trajectory import Pair

__all__ = ["RunStore", "default_root", "read_trajectory", "write_trajectory"]

HOME_VARIABLE = "MIRRORTWIN_HOME"
SCHEMA_VERSION = 3
BUSY_TIMEOUT_S = 5.0

logger = logging.getLogger(__name__)

SERVER_STOPPED = "the server stopped during this run; press Run again"

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
_KEPT = "id NOT IN (SELECT run FROM labels WHERE discarded IS NOT NULL)"
_COLUMNS = tuple(field.name for field in fields(RunRecord) if field.name != "actions")
_CHANGEABLE = frozenset(_COLUMNS) - {"id", "created", "plan", "fault", "code_version"}
_ACTIONS = "(SELECT listed FROM actions WHERE run = runs.id) AS actions"


def default_root() -> Path:
    """The folder named by ``MIRRORTWIN_HOME``, else ``.mirrortwin`` in the current one."""
    return Path(os.environ.get(HOME_VARIABLE) or ".mirrortwin").resolve()


class RunStore:
    """All runs under one folder. Thread-safe; several processes may use the same folder.

    A folder that cannot be written to can still be read: then `create`, `update` and the ``save_``
    methods raise `StoreError`. Every method may raise `StoreError` if the file system fails.
    """

    def __init__(self, root: Path) -> None:
        """Open the store at ``root``, making it if need be; raises `StoreError`."""
        self.root = root.resolve()
        self._lock = threading.RLock()
        self._index, self.read_only_reason = _open_index(self.root)

    def close(self) -> None:
        """Close the index; the store cannot be used afterwards."""
        with self._lock:
            self._index.close()

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
        self.enter(record)
        return record

    def enter(self, record: RunRecord) -> None:
        """Enter a record made elsewhere; raises `StoreError` if there is a run of its name."""
        row = {
            **record.to_dict(),
            "plan": _dumped(record.plan.to_dict()),
            "fault": _dumped(record.fault.to_dict()),
        }
        names = ", ".join(_COLUMNS)
        places = ", ".join(f":{name}" for name in _COLUMNS)
        with self.writing() as index:
            index.execute(f"INSERT INTO runs ({names}) VALUES ({places})", row)
            if record.actions:
                _write_actions(index, record.id, record.actions)

    def save_actions(self, run_id: str, actions: Iterable[Action]) -> None:
        """Keep what is done during a flight, in the place of what was kept before."""
        with self.writing() as index:
            _write_actions(index, run_id, actions)

    def update(self, run_id: str, **changes: Any) -> RunRecord:
        """Change fields of a record (status, error, top, top_probability, attempts)."""
        if not changes or not changes.keys() <= _CHANGEABLE:
            raise ValueError(f"cannot change {', '.join(changes) or 'nothing'}")
        if changes.get("status", "queued") not in STATUSES:
            raise ValueError(f"no status {changes['status']!r}")
        assignments = ", ".join(f"{name} = :{name}" for name in changes)
        with self.writing() as index:
            index.execute(
                f"UPDATE runs SET {assignments} WHERE id = :id", {**changes, "id": run_id}
            )
        return self.get(run_id)

    def get(self, run_id: str) -> RunRecord:
        """The record of one run; raises `StoreError` if there is none, or none any more."""
        rows = self._select(f"WHERE id = ? AND {_KEPT}", run_id)
        if not rows:
            raise StoreError(f"no run {run_id[:40]!r} in {self.root}")
        return _record(rows[0])

    def records(self) -> list[RunRecord]:
        """All records, newest first; those that this version cannot read are left out."""
        return list(_readable(self._select(f"WHERE {_KEPT} ORDER BY created DESC, rowid DESC")))

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

    # -- files -----------------------------------------------------------------------------------

    def save_pair(self, run_id: str, pair: Pair) -> None:
        """Keep both flights."""
        write_pair(self._folder(run_id, make=True) / "run.parquet", pair)

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
        write_json(self._folder(run_id, make=True) / "run.json", values)
        return self.update(run_id, status="done", error=None, top=top, top_probability=probability)

    def save_report(self, run_id: str, report: GroundedReport) -> None:
        """Keep another report on a run that is done, in the place of the last one."""
        path = self._file(run_id, "run.json")
        write_json(path, read_json(path) | {"report": report.to_dict()})

    def load_result(self, run_id: str) -> tuple[Diagnosis, GroundedReport]:
        """Diagnosis and report as saved."""
        return read_result(self._file(run_id, "run.json"))

    def recording_path(self, run_id: str) -> Path:
        """Where the run's ``.rrd`` is, or is to be written."""
        return self._folder(run_id, make=self.read_only_reason is None) / "run.rrd"

    # -- inside ----------------------------------------------------------------------------------

    def _folder(self, run_id: str, *, make: bool = False) -> Path:
        self.get(run_id)  # only names that we gave ourselves ever become a path
        folder = self.root / "runs" / run_id
        if make:
            try:
                folder.mkdir(parents=True, exist_ok=True)
            except OSError as error:
                raise write_error(self.root, error) from error
        return folder

    def _file(self, run_id: str, name: str) -> Path:
        record = self.get(run_id)
        path = self._folder(run_id) / name
        if not path.exists():
            raise StoreError(f"run {run_id} is {record.status}: it has no {name}")
        return path

    def _select(self, clause: str, *values: Any) -> list[sqlite3.Row]:
        return self.query(f"SELECT {', '.join(_COLUMNS)}, {_ACTIONS} FROM runs {clause}", *values)

    def query(self, query: str, *values: Any) -> list[sqlite3.Row]:
        """What a SELECT of the index finds; for this package alone."""
        try:
            with self._lock:
                return self._index.execute(query, values).fetchall()
        except sqlite3.Error as error:
            raise StoreError(f"cannot read the run index in {self.root}: {error}") from error

    @contextmanager
    def writing(self) -> Iterator[sqlite3.Connection]:
        """A transaction of the index; for this package alone."""
        with self._lock:
            if self.read_only_reason is not None:
                self._try_writable()
            try:
                with self._index:
                    yield self._index
            except sqlite3.Error as error:
                if "readonly" in str(error):  # the connection stays so: open anew next time
                    self.read_only_reason = str(error)
                raise _index_error(self.root, str(error)) from error

    def _try_writable(self) -> None:
        """Leave read-only mode if the folder can be written to by now; raises `StoreError`."""
        self._index.close()  # first: SQLite shares a read-only memory map with new connections
        self._index, self.read_only_reason = _open_index(self.root)
        if self.read_only_reason is not None:
            raise _index_error(self.root, self.read_only_reason)


def _record(row: sqlite3.Row) -> RunRecord:
    values = dict(row)
    try:
        values["plan"] = Plan.from_dict(json.loads(values["plan"]))
        values["fault"] = Fault.from_dict(json.loads(values["fault"]))
        values["actions"] = tuple(map(read_action, json.loads(values["actions"] or "[]")))
    except (InputError, ValueError, TypeError) as error:
        raise StoreError(f"run {row['id']} cannot be read by this version: {error}") from error
    return RunRecord(**values)


def read_result(path: Path) -> tuple[Diagnosis, GroundedReport]:
    """Diagnosis and report in a ``run.json``; raises `StoreError`."""
    values = read_json(path)
    try:
        diagnosis = Diagnosis.from_dict(values["diagnosis"])
        return diagnosis, _report(values["report"], diagnosis)
    except (KeyError, TypeError, ValueError) as error:
        raise StoreError(f"{path} is not a result of this version: {error}") from error


def _report(values: dict[str, Any], diagnosis: Diagnosis) -> GroundedReport:
    if "sentences" in values:
        return GroundedReport.from_dict(values)
    # A run of the time when reports were stored as plain text: what it says is checked now.
    return checked_report(open_case(diagnosis), Report.from_dict(values))


def _readable(rows: list[sqlite3.Row]) -> Iterator[RunRecord]:
    for row in rows:
        try:
            yield _record(row)
        except StoreError as error:
            logger.warning("left out of the list: %s", error)


def _write_actions(index: sqlite3.Connection, run_id: str, actions: Iterable[Action]) -> None:
    listed = _dumped([action_to_dict(action) for action in actions])
    index.execute("INSERT OR REPLACE INTO actions VALUES (?, ?)", (run_id, listed))


def _dumped(values: Any) -> str:
    return json.dumps(values, separators=(",", ":"), allow_nan=False)


def _index_error(root: Path, reason: str) -> StoreError:
    return StoreError(
        f"cannot write to the run store {root}: {reason}. What is stored is safe. Free space or "
        f"allow writing there, or start with another folder in {HOME_VARIABLE}."
    )


def _open_index(root: Path) -> tuple[sqlite3.Connection, str | None]:
    """The index and None, or a readable one and the reason why it cannot be written to."""
    try:
        (root / "runs").mkdir(parents=True, exist_ok=True)
        if not os.access(root, os.W_OK):
            raise PermissionError(errno.EACCES, "read-only folder")
        return _writable_index(root / "index.sqlite"), None
    except OSError as error:
        reason = error.strerror or str(error)
    except sqlite3.DatabaseError as error:
        if error.sqlite_errorname in ("SQLITE_NOTADB", "SQLITE_CORRUPT"):
            raise StoreError(f"{root / 'index.sqlite'} is damaged: {error}") from error
        reason = str(error)
    if root.exists() and not root.is_dir():
        raise StoreError(f"the run store {root} is a file, not a folder")
    return _readable_index(root / "index.sqlite"), reason


def _writable_index(path: Path) -> sqlite3.Connection:
    index = _connect(path.as_uri())
    try:
        index.execute("PRAGMA journal_mode = WAL")
        # In WAL mode NORMAL can lose the last rows to a power cut, but never harm the index.
        index.execute("PRAGMA synchronous = NORMAL")
        found = index.execute("PRAGMA user_version").fetchone()[0]
        if found > SCHEMA_VERSION:
            raise StoreError(
                f"{path} was written by a newer MirrorTwin; use that one, or another folder"
            )
        if found < SCHEMA_VERSION:
            index.executescript(f"{_SCHEMA} PRAGMA user_version = {SCHEMA_VERSION};")
    except BaseException:
        index.close()
        raise
    return index


def _readable_index(path: Path) -> sqlite3.Connection:
    # immutable: without leave to write, SQLite cannot make the shared memory that WAL needs.
    for options in ("mode=ro", "mode=ro&immutable=1"):
        try:
            index = _connect(f"{path.as_uri()}?{options}")
            index.execute("SELECT count(*) FROM runs")
            _add_missing_tables(index)
            return index
        except sqlite3.Error:
            continue
    if path.exists() and path.stat().st_size > 0:
        raise StoreError(f"cannot read {path}: is it damaged, or yours to read?")
    index = _connect("file::memory:")
    index.executescript(_SCHEMA)
    return index


def _add_missing_tables(index: sqlite3.Connection) -> None:
    """Empty ones, beside an index of an earlier version: it says nothing of what they are for."""
    for name, columns in (("labels", "run, tags, note, discarded"), ("actions", "run, listed")):
        if not index.execute("SELECT 1 FROM sqlite_master WHERE name = ?", (name,)).fetchone():
            index.execute(f"CREATE TEMP TABLE {name} ({columns})")


def _connect(uri: str) -> sqlite3.Connection:
    index = sqlite3.connect(uri, uri=True, timeout=BUSY_TIMEOUT_S, check_same_thread=False)
    index.row_factory = sqlite3.Row
    return index
