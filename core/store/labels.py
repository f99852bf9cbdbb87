"""What people write on runs, and the runs that they throw away.

A run thrown away is gone from every list and address at once. For a day it can be restored, whole,
unless its room is needed on a full disk; then its row and its files are deleted.
"""

import json
import logging
from collections.abc import Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta

from core.errors import DiskFullError, InputError, StoreError
from core.store.records import UNFINISHED, valid_run_id
from core.store.recovery import write_label_file
from core.store.store import RunStore

logger = logging.getLogger(__name__)

MAX_TAGS = 12
MAX_TAG = 32
MAX_NOTE = 2000

KEPT_FOR = timedelta(days=1)
"""How long a run thrown away can be restored."""


@dataclass(frozen=True, slots=True)
class Label:
    """What is written on a run. Plain text, whatever it looks like."""

    tags: tuple[str, ...] = ()
    note: str = ""

    def __post_init__(self) -> None:
        """Raise `InputError` for what is too long, or holds control characters."""
        if len(self.tags) > MAX_TAGS:
            raise InputError("tags", f"must be {MAX_TAGS} at most, got {len(self.tags)}")
        for tag in self.tags:
            if not 0 < len(tag) <= MAX_TAG:
                raise InputError("tags", f"must be of 1 to {MAX_TAG} characters, got {len(tag)}")
            if "," in tag or tag != _plain(tag):
                raise InputError("tags", f"must be words without commas, got {tag!r:.60}")
        if len(self.note) > MAX_NOTE:
            raise InputError(
                "note", f"must have {MAX_NOTE} characters at most, got {len(self.note)}"
            )
        if any(not line.isprintable() for line in self.note.split("\n")):
            raise InputError("note", "must be plain text")


def read_tags(text: str) -> tuple[str, ...]:
    """Tags as people type them: parted by commas, each once, spaces tidied.

    >>> read_tags(" shop floor, ,baffle,  shop   floor")
    ('shop floor', 'baffle')
    """
    return tuple(dict.fromkeys(filter(None, map(_plain, text.split(",")))))


def labels(store: RunStore) -> dict[str, Label]:
    """What is written on each run that has something written on it; raises `StoreError`."""
    rows = store.index.query("SELECT run, tags, note FROM labels WHERE discarded IS NULL")
    found = {}
    for row in rows:
        try:
            found[row["run"]] = Label(tuple(json.loads(row["tags"])), row["note"])
        except (InputError, ValueError, TypeError) as error:
            logger.warning("what is written on run %s cannot be read: %s", row["run"], error)
    return found


def label_of(store: RunStore, run_id: str) -> Label:
    """What is written on one run."""
    return labels(store).get(run_id, Label())


def write_label(store: RunStore, run_id: str, label: Label) -> None:
    """Write it on a run, in the place of what was there; raises `StoreError`."""
    store.get(run_id)
    store.save_label(run_id, {"tags": json.dumps(label.tags), "note": label.note})


def discard(store: RunStore, run_ids: Sequence[str]) -> list[str]:
    """Throw runs away, all or none; returns those that can be restored.

    That is all of them, but on a full disk none: then there is no room to note it before there is
    the room that they took. Raises `InputError` if one is being flown, or `StoreError`.
    """
    for run_id in run_ids:
        if store.get(run_id).status in UNFINISHED:
            raise InputError("run", f"{run_id} is still being flown; cancel it first")
    now = datetime.now(UTC).isoformat()

    def mark() -> None:
        with store.index.writing() as index:
            index.executemany(
                "INSERT INTO labels (run, discarded) VALUES (?, ?) "
                "ON CONFLICT (run) DO UPDATE SET discarded = excluded.discarded",
                [(run_id, now) for run_id in run_ids],
            )

    try:
        store.with_room(mark)
    except DiskFullError:
        delete(store, run_ids)
        return []
    with suppress(StoreError):  # at worst they come back with an index that is made again
        _note_beside(store, run_ids)
    return list(run_ids)


def _note_beside(store: RunStore, run_ids: Iterable[str], **changes: object) -> None:
    """Keep beside the runs what the index says of them, but for ``changes``."""
    for run_id in run_ids:
        for row in store.index.query(
            "SELECT tags, note, discarded FROM labels WHERE run = ?", run_id
        ):
            write_label_file(store.root / "runs" / run_id, dict(row) | changes)


def discarded(store: RunStore) -> list[str]:
    """The runs that can be restored, last thrown away first."""
    rows = store.index.query(
        "SELECT run FROM labels WHERE discarded IS NOT NULL ORDER BY discarded DESC"
    )
    return [row["run"] for row in rows]


def restore(store: RunStore, run_ids: Iterable[str]) -> list[str]:
    """Have runs back, with all that was written on them; returns those that there still were."""
    known = set(discarded(store))
    run_ids = [run_id for run_id in run_ids if run_id in known]
    # First: a run that is noted as thrown away would not outlive an index that is made again.
    _note_beside(store, run_ids, discarded=None)
    with store.index.writing() as index:
        return [
            run_id
            for run_id in run_ids
            if index.execute(
                "UPDATE labels SET discarded = NULL WHERE run = ? AND discarded IS NOT NULL "
                "RETURNING run",
                (run_id,),
            ).fetchall()
        ]


def empty(store: RunStore, older_than: timedelta = KEPT_FOR) -> list[str]:
    """Delete what was thrown away that long ago; returns it. Raises `StoreError`."""
    return store.purge((datetime.now(UTC) - older_than).isoformat())


def delete(store: RunStore, run_ids: Sequence[str]) -> None:
    """Delete runs, files, row and label, beyond undoing; raises `StoreError`."""
    if named := [run_id for run_id in run_ids if valid_run_id(run_id)]:
        store.delete(named)


def _plain(tag: str) -> str:
    """One line of printable characters, without spaces around it or doubled in it."""
    return " ".join("".join(c if c.isprintable() else " " for c in tag).split())
