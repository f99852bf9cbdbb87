"""What a store does when it is opened: finds runs that its index lost, clears what kills left.

Each run folder says all there is to know of a finished run: the record in ``run.json``, and in
``label.json`` what people wrote on it, or that they threw it away. So an index that was deleted,
emptied or damaged is filled from the folders; from a damaged one also what can still be read of
runs that left no files.
"""

import json
import logging
import shutil
import sqlite3
from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

from core.errors import MirrorTwinError, StoreError
from core.files import check_seal, is_temporary, read_json, write_json
from core.store import rows
from core.store.index import connect
from core.store.records import RunRecord, is_storable, read_record, valid_run_id

logger = logging.getLogger(__name__)

LABEL = "label.json"
IMPORT_PREFIX = ".import-"

Row = dict[str, Any]


def stored_record(folder: Path) -> RunRecord | None:
    """The record of a finished run, from its folder; None if it holds none."""
    path = folder / "run.json"
    if not path.exists():
        return None
    try:
        values = read_json(path)
        check_seal(path, values)
        record = read_record(values["record"])
    except (MirrorTwinError, KeyError, TypeError, AttributeError, RecursionError) as error:
        logger.warning("left alone: %s", error)
        return None
    if record.id != folder.name or record.status != "done":
        logger.warning("left alone: %s tells of %s, %s", path, record.id, record.status)
        return None
    return record


# -- what people wrote, beside the run -----------------------------------------------------------


def write_label_file(folder: Path, row: Mapping[str, Any] | None) -> None:
    """Keep a row of the labels beside the run, None for nothing; raises `StoreError`."""
    path = folder / LABEL
    try:
        if row is None or not (row["note"] or row["discarded"] or row["tags"] != "[]"):
            path.unlink(missing_ok=True)
            return
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise StoreError(f"cannot write to {folder}: {error.strerror}") from error
    values = {"tags": json.loads(row["tags"]), "note": row["note"], "discarded": row["discarded"]}
    write_json(path, values)


def read_label_file(folder: Path) -> Row | None:
    """A row of the labels as it is kept beside the run; None if there is none."""
    if not (folder / LABEL).exists():
        return None
    try:
        values = read_json(folder / LABEL)
        row = {"tags": json.dumps(values["tags"]), "note": values["note"],
               "discarded": values["discarded"]}  # fmt: skip
        is_sound = all(isinstance(tag, str) and is_storable(tag) for tag in values["tags"])
    except (StoreError, KeyError, TypeError) as error:
        logger.warning("left alone: %s: %s", folder / LABEL, error)
        return None
    return row if is_sound and is_label(row) else None


def is_label(row: Row) -> bool:
    """Whether a row of the labels is one."""
    texts = (row["tags"], row["note"], row["discarded"] or "")
    return all(isinstance(text, str) and is_storable(text) for text in texts)


# -- a new index in the place of one that was lost ------------------------------------------------


def salvaged(damaged: Path) -> tuple[list[Row], list[Row], list[Row]]:
    """What can still be read of a damaged index: rows of runs, labels and actions."""
    try:
        index = connect(f"{damaged.as_uri()}?mode=ro")
    except sqlite3.Error:
        return [], [], []
    try:
        runs = {row["id"]: row for row in _rows(index, "runs") if "id" in row}
        labels = {row["run"]: row for row in _rows(index, "labels") if "run" in row}
        actions = {row["run"]: row for row in _rows(index, "actions") if "run" in row}
        return list(runs.values()), list(labels.values()), list(actions.values())
    finally:
        index.close()


def _rows(index: sqlite3.Connection, table: str) -> Iterator[Row]:
    """The rows of a table up to the first damage, from either end."""
    for order in ("", " ORDER BY rowid DESC"):
        with suppress(sqlite3.Error, UnicodeDecodeError):
            for row in index.execute(f"SELECT * FROM {table}{order}"):
                yield dict(row)


def read_row(row: Row, listed: str | None) -> RunRecord | None:
    """A record from a row of a damaged index; None unless all of it is sound."""
    try:
        values = {
            **row,
            "plan": json.loads(row["plan"]),
            "fault": json.loads(row["fault"]),
            "actions": json.loads(listed or "[]"),
        }
        return read_record(values)
    except (MirrorTwinError, ValueError, KeyError, TypeError, RecursionError):
        return None


def adopt(index: sqlite3.Connection, root: Path, known: set[str], set_aside: Path | None) -> None:
    """Enter all runs that have a folder and no row, ``known`` being those that have one.

    ``set_aside``: a damaged index, from which everything is entered that has no folder. The log
    says what was found.
    """
    lost = sorted(_run_folders(root) - known)
    records: dict[str, RunRecord] = {}
    labels: dict[str, Row] = {}
    for name in lost:
        if record := stored_record(root / "runs" / name):
            records[name] = record
            if label := read_label_file(root / "runs" / name):
                labels[name] = label
    if set_aside is not None:
        _add_salvaged(set_aside, records, labels)
    try:
        with index:
            for record in records.values():
                rows.insert(index, record)
            for name, label in labels.items():
                rows.insert_label(index, name, label)
    except sqlite3.Error as error:
        logger.warning("runs of %s that are not in its index stay so: %s", root, error)
        return
    left = [name for name in lost if name not in records and _holds_flight(root / "runs" / name)]
    _say_found(root, len(records), len(left), is_new=not known, set_aside=set_aside)


def _add_salvaged(set_aside: Path, records: dict[str, RunRecord], labels: dict[str, Row]) -> None:
    found, old_labels, old_actions = salvaged(set_aside)
    listed = {row["run"]: row.get("listed") for row in old_actions}
    for row in found:
        if record := read_row(row, listed.get(row["id"])):
            records.setdefault(record.id, record)
    for row in old_labels:
        if row["run"] in records and is_label(row):
            labels.setdefault(row["run"], row)


def _run_folders(root: Path) -> set[str]:
    try:
        return {path.name for path in (root / "runs").iterdir() if valid_run_id(path.name)}
    except OSError:
        return set()


def _holds_flight(folder: Path) -> bool:
    return (folder / "run.parquet").exists() or (folder / "run.json").exists()


def _say_found(root: Path, n: int, n_left: int, *, is_new: bool, set_aside: Path | None) -> None:
    """Tell the log, which is the terminal unless somebody sends it elsewhere, what was found."""
    found = f"{n} run{'s' if n != 1 else ''} found"
    if n_left:
        found += f"; {n_left} run folders without a whole run.json were left as they are"
    if set_aside is not None:
        logger.warning("the run index of %s was rebuilt from the run folders: %s", root, found)
    elif is_new and (n or n_left):
        logger.warning(
            "the run index of %s was missing or empty, and rebuilt from the run folders: %s",
            root, found,
        )  # fmt: skip
    elif n:
        logger.warning("runs of %s that were not in its index were entered: %s", root, found)


# -- what was left behind ------------------------------------------------------------------------


def sweep(root: Path) -> None:
    """Clear what killed writers left: unfinished files, unpacked imports, empty run folders.

    Only for a process that knows that no other one has the store open. What is not ours stays.
    """
    _sweep_files(root)
    for folder in _folders(root / "runs"):
        if folder.name.startswith(IMPORT_PREFIX):
            shutil.rmtree(folder, ignore_errors=True)
        elif valid_run_id(folder.name):
            _sweep_files(folder)
            with suppress(OSError):  # it holds something
                folder.rmdir()
    for folder in _folders(root / "teach"):
        if valid_run_id(folder.name):
            _sweep_files(folder)
            if not (folder / "attempt.json").exists():  # written last: it was never begun
                shutil.rmtree(folder, ignore_errors=True)
    _sweep_files(root / "teach")


def _folders(parent: Path) -> list[Path]:
    try:
        return [path for path in parent.iterdir() if path.is_dir() and not path.is_symlink()]
    except OSError:
        return []


def _sweep_files(folder: Path) -> None:
    with suppress(OSError):
        for path in folder.iterdir():
            if is_temporary(path.name) and path.is_file():
                path.unlink()


def complete(index: sqlite3.Connection, root: Path, unfinished: Iterable[RunRecord]) -> None:
    """Bring the index and what lies beside the runs to the same state.

    A run may have been stored whole before its row could say so. What people wrote on runs was
    once kept in the index alone.
    """
    with suppress(sqlite3.Error, StoreError):  # a full disk: the next time
        for record in unfinished:
            folder = root / "runs" / record.id
            done = stored_record(folder) if (folder / "run.parquet").exists() else None
            if done is not None:
                with index:
                    index.execute(
                        "UPDATE runs SET status = 'done', error = NULL, top = ?, "
                        "top_probability = ? WHERE id = ?",
                        (done.top, done.top_probability, done.id),
                    )
        for row in index.execute("SELECT run, tags, note, discarded FROM labels").fetchall():
            folder = root / "runs" / str(row["run"])
            if valid_run_id(folder.name) and folder.is_dir() and not (folder / LABEL).exists():
                with suppress(ValueError):  # tags that are no JSON
                    write_label_file(folder, dict(row))
