"""Table 6: how good reports are, by the template and by a language model, raw and grounded.

Test runs on fresh seeds, every class alike, diagnosed by the shipped network; nothing tells a
writer what was injected. The language model is the endpoint that the environment names
(``MIRRORTWIN_LLM_URL``), else the local one of the ``local-llm`` extra; where there is neither,
only the template is measured, and the result says so. Measures: `core.report.check.metrics`.

What a writer made of a run is kept in `WORK`, so that the table can be filled bit by bit: a small
machine needs an hour for it.
"""

import hashlib
import math
import time
from collections.abc import Iterator, Mapping
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import plotly.graph_objects as go

from core.diagnosis.diagnosis import Diagnosis
from core.diagnosis.predict import load_diagnoser
from core.errors import StoreError
from core.experiments.drawing import BLUE, FONT, GREY, ORANGE, axis
from core.experiments.results import Progress, Result
from core.files import read_json, write_json
from core.fmea.catalogue import class_ids
from core.fmea.fault import Fault
from core.paths import MODELS, ROOT
from core.provenance import twin_fingerprint
from core.report.case.case import open_case
from core.report.check.metrics import PAPER, Metrics
from core.report.grounded import Done, write_grounded
from core.report.write.endpoint import Endpoint
from core.report.write.local_model import local_model, model_file
from core.report.write.writers import ModelWriter, TemplateWriter, Writer
from core.twin.flight import fly_pair
from core.twin.plan import Plan

FIRST_SEED = 700_000
"""Seeds of these flights: in no training, validation or test set."""

SEVERITIES = (0.4, 0.7, 1.0)
ONSET_S = 60.0

RUNS_PER_CLASS, QUICK_CLASSES = 3, 4
MEASURES = ("ccc", "sec", "dc", "hr")

NO_MODEL = "none: no endpoint is configured and the local-llm extra is not installed"

WORK = Path("data") / "table6"
"""Where finished reports are kept, in the current folder."""

WRITES = (
    "core/report/**/*.py",
    "core/knowledge/*.py",
    "assets/data/prompts/*",
    "assets/data/report/*",
    "assets/data/fmea/*.toml",
)
"""The files that shape a report and its measures."""


@dataclass(frozen=True, slots=True)
class Flight:
    """A test run: its seed and what is injected."""

    seed: int
    fault: Fault


@dataclass(frozen=True, slots=True)
class Measured:
    """What a writer made of a run: the class it was diagnosed as, and the measures of its text."""

    top: str
    raw: Metrics
    final: Metrics

    def to_dict(self) -> dict[str, Any]:
        """Plain JSON-ready values; `from_dict` reads them back."""
        return {"top": self.top, "raw": self.raw.to_dict(), "final": self.final.to_dict()}

    @classmethod
    def from_dict(cls, values: Mapping[str, Any]) -> "Measured":
        """Read what `to_dict` wrote."""
        return cls(values["top"], Metrics(**values["raw"]), Metrics(**values["final"]))


def run(quick: bool, progress: Progress, minutes: float = math.inf) -> Result:
    """Fly, diagnose, let every writer write, and measure; raises `FlightError`.

    After ``minutes`` a language model begins no further run: its rows say how many it did.
    """
    deadline = time.monotonic() + 60.0 * minutes
    flights = list(_flights(quick))
    with ExitStack() as stack:
        endpoint, model = _endpoint(stack)
        writers: dict[str, Writer] = {"template": TemplateWriter()}
        if endpoint is not None:
            writers["with_fmea"] = ModelWriter(endpoint)
            writers["no_fmea"] = ModelWriter(endpoint, knowledge=False)
        bench = _Bench(None if quick else WORK, model, {})
        found: dict[str, list[Measured]] = {name: [] for name in writers}
        for flight in flights:
            found["template"].append(bench.measured(flight, "template", writers["template"]))
        models = [name for name in writers if name != "template"]
        for done, flight in enumerate(flights, start=1):
            for name in models:
                if bench.is_kept(flight, name) or time.monotonic() < deadline:
                    found[name].append(bench.measured(flight, name, writers[name]))
            progress(done / len(flights))
    rows = [
        _row(name, grounded, [each.final if grounded else each.raw for each in measured])
        for name, measured in found.items()
        for grounded in (False, True)
    ]
    right = sum(
        item.top == flight.fault.mode
        for item, flight in zip(found["template"], flights, strict=True)
    )
    return Result(
        name="table6-lab",
        settings={
            "quick": quick,
            "runs": len(flights),
            "first_seed": FIRST_SEED,
            "severities": list(SEVERITIES),
            "conditions": "lab",
            "language_model": model,
            "diagnosed_right": right,
            "measures": "defined in core/report/check/metrics.py; the paper gives no formulas",
        },
        findings={"rows": rows, "paper": {name: row.to_dict() for name, row in PAPER.items()}},
        figure=_figure(rows),
        summary=tuple(map(_line, rows)),
    )


def _flights(quick: bool) -> Iterator[Flight]:
    """Every class once, then every class again: also a part of them treats all alike."""
    classes = class_ids()
    chosen = classes[:: len(classes) // QUICK_CLASSES] if quick else classes
    per_class = 1 if quick else RUNS_PER_CLASS
    for each in range(per_class):
        for index, mode in enumerate(chosen):
            severity = SEVERITIES[(index + each) % len(SEVERITIES)]
            yield Flight(FIRST_SEED + index * per_class + each, Fault(mode, severity, ONSET_S))


@dataclass(frozen=True, slots=True)
class _Bench:
    """Reports measured, and kept in ``folder`` if there is one. ``model``: who writes them."""

    folder: Path | None
    model: str
    diagnoses: dict[int, Diagnosis]

    def measured(self, flight: Flight, name: str, writer: Writer) -> Measured:
        """What ``writer``, called ``name``, makes of a flight: kept, or written now."""
        kept = self._kept(flight, name)
        if kept is not None:
            return kept
        case = open_case(self._diagnosis(flight))
        *_, done = write_grounded(case, writer)
        assert isinstance(done, Done)
        found = Measured(case.top.mode.id, done.report.raw, done.report.final)
        if self.folder is not None:
            self.folder.mkdir(parents=True, exist_ok=True)
            values = {"identity": self._identity(name), **found.to_dict()}
            write_json(self._path(self.folder, flight, name), values)
        return found

    def is_kept(self, flight: Flight, name: str) -> bool:
        """Whether that was measured before."""
        return self._kept(flight, name) is not None

    def _kept(self, flight: Flight, name: str) -> Measured | None:
        if self.folder is None:
            return None
        try:
            values = read_json(self._path(self.folder, flight, name))
            same = values["identity"] == self._identity(name)
            return Measured.from_dict(values) if same else None
        except (StoreError, KeyError, TypeError):
            return None

    def _path(self, folder: Path, flight: Flight, name: str) -> Path:
        return folder / f"{flight.seed}-{flight.fault.mode}-{name}.json"

    def _diagnosis(self, flight: Flight) -> Diagnosis:
        if flight.seed not in self.diagnoses:
            pair = fly_pair(Plan.sampled(flight.seed), flight.fault)
            self.diagnoses[flight.seed] = load_diagnoser().diagnose(pair)
        return self.diagnoses[flight.seed]

    def _identity(self, name: str) -> str:
        """A digest of all that the report depends on; a report of another digest is not used."""
        digest = hashlib.sha256(twin_fingerprint().encode())
        if name != "template":
            digest.update(self.model.encode())
        for pattern in (*WRITES, f"{MODELS.name}/cnn-paired-lab.safetensors"):
            for path in sorted(ROOT.glob(pattern)):
                digest.update(path.read_bytes())
        return digest.hexdigest()[:16]


def _endpoint(stack: ExitStack) -> tuple[Endpoint | None, str]:
    """The language model to measure, running as long as ``stack``, and its name."""
    if (configured := Endpoint.from_environment()) is not None:
        return configured, configured.model
    if model_file() is None:
        return None, NO_MODEL
    local = stack.enter_context(local_model())
    return local, f"{local.model} (local)"


def _row(writer: str, grounded: bool, measured: list[Metrics]) -> dict[str, Any]:
    """One row: means and spreads, null where nothing was measured, and the paper's beside."""
    values = np.array([[getattr(each, name) for name in MEASURES] for each in measured])
    means = values.mean(axis=0).round(4).tolist() if measured else [None] * len(MEASURES)
    spreads = values.std(axis=0).round(4).tolist() if measured else [None] * len(MEASURES)
    return {
        "writer": writer,
        "grounded": grounded,
        "runs": len(measured),
        **dict(zip(MEASURES, means, strict=True)),
        "sd": dict(zip(MEASURES, spreads, strict=True)),
        "paper": PAPER[writer].to_dict(),
    }


def _line(row: Mapping[str, Any]) -> str:
    if not row["runs"]:
        return f"{row['writer']:<10}not measured"
    ours = "  ".join(f"{name.upper()} {row[name]:.3f}" for name in MEASURES)
    theirs = " ".join(f"{row['paper'][name]:.3f}" for name in MEASURES)
    kind = "grounded" if row["grounded"] else "raw"
    return f"{row['writer']:<10}{kind:<10}{ours}   paper: {theirs}   {row['runs']} runs"


def _figure(rows: list[dict[str, Any]]) -> go.Figure:
    """Bars by writer, ours raw and grounded beside the paper's, a panel a measure."""
    figure = go.Figure()
    writers = list(dict.fromkeys(row["writer"] for row in rows))
    groups = [(name, writer) for name in MEASURES for writer in writers]
    labels = [[name.upper() for name, _ in groups], [writer for _, writer in groups]]
    ours = {(row["writer"], row["grounded"]): row for row in rows}
    paper = {row["writer"]: row["paper"] for row in rows}
    for title, colour, heights in (
        ("raw", ORANGE, [ours[writer, False][name] for name, writer in groups]),
        ("grounded", BLUE, [ours[writer, True][name] for name, writer in groups]),
        ("paper", GREY, [paper[writer][name] for name, writer in groups]),
    ):
        figure.add_bar(x=labels, y=heights, name=title, marker_color=colour)
    figure.update_layout(
        template="none",
        font=FONT,
        width=900,
        height=420,
        barmode="group",
        xaxis=axis(),
        yaxis=axis("share", range=[0, 1.05]),
        legend={"orientation": "h", "y": 1.12},
        margin={"l": 60, "r": 20, "t": 50, "b": 90},
    )
    return figure
