"""The rows of a store's index: a record as a row, and a row as a record."""

import json
import logging
import sqlite3
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import fields
from typing import Any

from core.errors import InputError, StoreError
from core.fmea.fault import Fault
from core.store.records import RunRecord, check_record
from core.twin.actions import Action, action_to_dict, read_action
from core.twin.plan import Plan

logger = logging.getLogger(__name__)

COLUMNS = tuple(field.name for field in fields(RunRecord) if field.name != "actions")
NO_LABEL: Mapping[str, Any] = {"tags": "[]", "note": "", "discarded": None}


def record_of(row: sqlite3.Row) -> RunRecord:
    """The record of a row; raises `StoreError` if this version cannot read it."""
    values = dict(row)
    try:
        values["plan"] = Plan.from_dict(json.loads(values["plan"]))
        values["fault"] = Fault.from_dict(json.loads(values["fault"]))
        values["actions"] = tuple(map(read_action, json.loads(values["actions"] or "[]")))
        record = RunRecord(**values)
        check_record(record)
    except (InputError, ValueError, TypeError, AttributeError, RecursionError) as error:
        name = str(row["id"])[:40]
        raise StoreError(f"run {name} cannot be read by this version: {error}") from error
    return record


def readable(rows: Iterable[sqlite3.Row]) -> Iterator[RunRecord]:
    """The records of those rows that this version can read; the log says which it cannot."""
    for row in rows:
        try:
            yield record_of(row)
        except StoreError as error:
            logger.warning("left out of the list: %s", error)


def insert(index: sqlite3.Connection, record: RunRecord) -> None:
    """Enter a record."""
    row = {
        **record.to_dict(),
        "plan": _dumped(record.plan.to_dict()),
        "fault": _dumped(record.fault.to_dict()),
    }
    names, places = ", ".join(COLUMNS), ", ".join(f":{name}" for name in COLUMNS)
    index.execute(f"INSERT INTO runs ({names}) VALUES ({places})", row)
    if record.actions:
        write_actions(index, record.id, record.actions)


def insert_label(index: sqlite3.Connection, run_id: str, label: Mapping[str, Any]) -> None:
    """Enter what people wrote on a run, in the place of what was there."""
    index.execute(
        "INSERT OR REPLACE INTO labels (run, tags, note, discarded) "
        "VALUES (:run, :tags, :note, :discarded)",
        {"run": run_id, **{name: label.get(name, NO_LABEL[name]) for name in NO_LABEL}},
    )


def forget(index: sqlite3.Connection, run_id: str) -> None:
    """Delete all rows of a run."""
    for table, column in (("runs", "id"), ("labels", "run"), ("actions", "run")):
        index.execute(f"DELETE FROM {table} WHERE {column} = ?", (run_id,))


def write_actions(index: sqlite3.Connection, run_id: str, actions: Iterable[Action]) -> None:
    """Enter what is done during a flight, in the place of what was there."""
    listed = _dumped([action_to_dict(action) for action in actions])
    index.execute("INSERT OR REPLACE INTO actions VALUES (?, ?)", (run_id, listed))


def _dumped(values: Any) -> str:
    return json.dumps(values, separators=(",", ":"), allow_nan=False)
