"""A data set on disk: one array file a run, a journal while it grows, a manifest when whole.

    runs/<id>.npy    (2, rows, 23) float32: faulted channels, then the mirror's
    journal.jsonl    a line per stored run, first the header with the specification
    manifest.json    specification, provenance and all runs with their checksums; written last

A run counts as stored once its journal line is written, which happens after its file is whole, so
a kill at any moment costs at most the run in hand.
"""

import hashlib
import io
import json
from collections.abc import Iterator
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from core.arrays import Array32
from core.clock import DT_S
from core.errors import InputError, StoreError
from core.files import whole_file, write_json
from core.provenance import provenance
from core.twin.trajectory import Pair, Trajectory

JOURNAL = "journal.jsonl"
MANIFEST = "manifest.json"


@dataclass(frozen=True, slots=True)
class StoredRun:
    """One run of the data set: what it is, which samples were kept, and their checksum.

    ``start_row`` is the first kept sample's index in the flight, ``departure_row`` that of the
    first sample that shows the fault, None if none does. ``plan`` and ``fault``
    are in their JSON form.
    """

    id: str
    mode: str
    split: str
    start_row: int
    departure_row: int | None
    plan: dict[str, Any]
    fault: dict[str, Any]
    sha256: str = ""

    @property
    def shown_row(self) -> int:
        """Where in the kept stretch the fault begins to show; the planned onset if it never does.

        This, not the onset, is where windows of the fault begin: before it there is nothing that
        any method could tell from a healthy flight.
        """
        onset_row = round(self.fault["onset_s"] / DT_S)
        row = onset_row if self.departure_row is None else self.departure_row
        return row - self.start_row


@dataclass(frozen=True, slots=True)
class Manifest:
    """What a whole data set holds."""

    spec: dict[str, Any]
    provenance: dict[str, str]
    runs: tuple[StoredRun, ...]

    def to_dict(self) -> dict[str, Any]:
        """Plain JSON-ready values, as in ``manifest.json``."""
        return {
            "spec": self.spec,
            "provenance": self.provenance,
            "runs": [asdict(run) for run in self.runs],
        }

    def part(self, split: str) -> tuple[StoredRun, ...]:
        """The runs of one split: ``train``, ``validation`` or ``test``."""
        return tuple(run for run in self.runs if run.split == split)


class Archive:
    """A data set folder being filled."""

    def __init__(self, folder: Path, header: dict[str, Any], runs: dict[str, StoredRun]) -> None:
        """Use `open`. ``header`` holds ``spec`` and ``provenance``, ``runs`` what is whole."""
        self.folder = folder
        self._header = header
        self._runs = runs

    @classmethod
    def open(cls, folder: Path, spec: dict[str, Any]) -> "Archive":
        """Open a data set of ``spec`` in ``folder``: a new one, or the one that lies there.

        Runs are believed only if their file still has its checksum. Raises `InputError` if the
        folder holds a data set of another specification or of another twin, `StoreError` if it
        cannot be written.
        """
        header = {"spec": spec, "provenance": provenance()}
        journal = folder / JOURNAL
        try:
            (folder / "runs").mkdir(parents=True, exist_ok=True)
            if not journal.exists():
                journal.write_text(json.dumps(header) + "\n", encoding="utf-8")
            found, runs = _read_journal(journal)
        except OSError as error:
            raise StoreError(f"data set folder {folder}: {error.strerror}") from None
        for what, theirs, ours in (
            ("specification", found["spec"], spec),
            ("twin", found["provenance"]["twin"], header["provenance"]["twin"]),
        ):
            if theirs != ours:
                raise InputError("out", f"{folder} holds a data set of another {what}")
        whole = {run.id: run for run in runs if _is_whole(folder, run)}
        return cls(folder, found, whole)

    def holds(self, run_id: str) -> bool:
        """Whether that run is stored whole."""
        return run_id in self._runs

    def add(self, run: StoredRun, channels: Array32) -> None:
        """Store a run, (2, rows, 23); raises `StoreError` if the disk will not take it."""
        content = io.BytesIO()
        np.save(content, channels)
        run = replace(run, sha256=hashlib.sha256(content.getbuffer()).hexdigest())
        with whole_file(run_path(self.folder, run.id)) as temporary:
            temporary.write_bytes(content.getbuffer())
        try:
            with (self.folder / JOURNAL).open("a", encoding="utf-8") as journal:
                journal.write(json.dumps(asdict(run)) + "\n")
        except OSError as error:
            raise StoreError(f"data set folder {self.folder}: {error.strerror}") from None
        self._runs[run.id] = run

    def complete(self, order: list[str]) -> Manifest:
        """Write the manifest, runs in ``order`` whatever order they landed in, and read it back."""
        runs = tuple(self._runs[run] for run in order)
        manifest = Manifest(self._header["spec"], self._header["provenance"], runs)
        write_json(self.folder / MANIFEST, manifest.to_dict())
        return read_manifest(self.folder)


def read_manifest(folder: Path) -> Manifest:
    """The manifest of a whole data set; raises `InputError` if there is none."""
    try:
        values = json.loads((folder / MANIFEST).read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise InputError("data", f"{folder} holds no complete data set") from None
    except (OSError, ValueError) as error:
        raise InputError("data", f"{folder / MANIFEST} cannot be read: {error}") from None
    runs = tuple(StoredRun(**run) for run in values["runs"])
    return Manifest(values["spec"], values["provenance"], runs)


def run_path(folder: Path, run_id: str) -> Path:
    """Where a run's channels lie."""
    return folder / "runs" / f"{run_id}.npy"


def read_run(folder: Path, run: StoredRun) -> Pair:
    """The kept stretch of a run, mapped from disk, with its true times and without states."""
    faulted, mirror = np.load(run_path(folder, run.id), mmap_mode="r")
    time_s = (run.start_row + np.arange(len(faulted), dtype=np.float64)) * DT_S
    no_states = np.empty((len(faulted), 0))
    return Pair(Trajectory(time_s, no_states, faulted), Trajectory(time_s, no_states, mirror))


def _read_journal(journal: Path) -> tuple[dict[str, Any], list[StoredRun]]:
    """The header and the runs; a last line cut short by a kill is dropped and closed."""
    lines = _whole_lines(journal)
    header = next(lines, None)
    if header is None:
        raise InputError("out", f"{journal} is not a data set's journal")
    return header, [StoredRun(**line) for line in lines]


def _whole_lines(journal: Path) -> Iterator[dict[str, Any]]:
    text = journal.read_text(encoding="utf-8")
    if not text.endswith("\n"):
        with journal.open("a", encoding="utf-8") as end:
            end.write("\n")
    for line in text.splitlines():
        try:
            yield json.loads(line)
        except ValueError:
            continue


def _is_whole(folder: Path, run: StoredRun) -> bool:
    try:
        content = run_path(folder, run.id).read_bytes()
    except OSError:
        return False
    return hashlib.sha256(content).hexdigest() == run.sha256
