"""Table 6: how good reports are, by the template and by a language model, raw and grounded.

Test runs on fresh seeds, every class alike, diagnosed by the shipped network; nothing tells a
writer what was injected. The language model is the endpoint that the environment names
(``MIRRORTWIN_LLM_URL``), else the local one of the ``local-llm`` extra; where there is neither,
only the template is measured, and the result says so. Measures: `core.report.metrics`.
"""

from collections.abc import Iterator, Mapping
from contextlib import ExitStack
from typing import Any

import numpy as np
import plotly.graph_objects as go

from core.diagnosis.predict import load_diagnoser
from core.experiments.drawing import BLUE, FONT, GREY, ORANGE, axis
from core.experiments.results import Progress, Result
from core.fmea.catalogue import class_ids
from core.fmea.fault import Fault
from core.report.case import Case, open_case
from core.report.endpoint import Endpoint
from core.report.grounded import Done, GroundedReport, write_grounded
from core.report.local_model import local_model, model_file
from core.report.metrics import PAPER, Metrics
from core.report.writers import ModelWriter, TemplateWriter, Writer
from core.twin.flight import fly_pair
from core.twin.plan import Plan

FIRST_SEED = 700_000
"""Seeds of these flights: in no training, validation or test set."""

SEVERITIES = (0.4, 0.7, 1.0)
ONSET_S = 60.0

RUNS_PER_CLASS, QUICK_CLASSES = 3, 4
MEASURES = ("ccc", "sec", "dc", "hr")

NO_MODEL = "none: no endpoint is configured and the local-llm extra is not installed"


def run(quick: bool, progress: Progress) -> Result:
    """Fly, diagnose, let every writer write, and measure; raises `FlightError`."""
    flights = list(_flights(quick))
    with ExitStack() as stack:
        endpoint, model = _endpoint(stack)
        writers: dict[str, Writer] = {"template": TemplateWriter()}
        if endpoint is not None:
            writers["with_fmea"] = ModelWriter(endpoint)
            writers["no_fmea"] = ModelWriter(endpoint, knowledge=False)
        reports: dict[str, list[GroundedReport]] = {name: [] for name in writers}
        right = 0
        for done, (seed, fault) in enumerate(flights, start=1):
            case = _case(seed, fault)
            right += case.top.mode.id == fault.mode
            for name, writer in writers.items():
                reports[name].append(_written(case, writer))
            progress(done / len(flights))
    rows = [
        _row(name, grounded, [each.final if grounded else each.raw for each in written])
        for name, written in reports.items()
        for grounded in (False, True)
    ]
    return Result(
        name="table6",
        settings={
            "quick": quick,
            "runs": len(flights),
            "first_seed": FIRST_SEED,
            "severities": list(SEVERITIES),
            "conditions": "lab",
            "language_model": model,
            "diagnosed_right": right,
            "measures": "defined in core/report/metrics.py; the paper gives no formulas",
        },
        findings={"rows": rows, "paper": {name: row.to_dict() for name, row in PAPER.items()}},
        figure=_figure(rows),
        summary=tuple(map(_line, rows)),
    )


def _flights(quick: bool) -> Iterator[tuple[int, Fault]]:
    classes = class_ids()
    chosen = classes[:: len(classes) // QUICK_CLASSES] if quick else classes
    per_class = 1 if quick else RUNS_PER_CLASS
    for index, mode in enumerate(chosen):
        for each in range(per_class):
            severity = SEVERITIES[(index + each) % len(SEVERITIES)]
            yield FIRST_SEED + index * per_class + each, Fault(mode, severity, ONSET_S)


def _case(seed: int, fault: Fault) -> Case:
    return open_case(load_diagnoser().diagnose(fly_pair(Plan.sampled(seed), fault)))


def _endpoint(stack: ExitStack) -> tuple[Endpoint | None, str]:
    """The language model to measure, running as long as ``stack``, and its name."""
    if (configured := Endpoint.from_environment()) is not None:
        return configured, configured.model
    if model_file() is None:
        return None, NO_MODEL
    local = stack.enter_context(local_model())
    return local, f"{local.model} (local)"


def _written(case: Case, writer: Writer) -> GroundedReport:
    *_, done = write_grounded(case, writer)
    assert isinstance(done, Done)
    return done.report


def _row(writer: str, grounded: bool, measured: list[Metrics]) -> dict[str, Any]:
    """One row of the table: means, spreads, and the paper's values beside."""
    values = np.array([[getattr(each, name) for name in MEASURES] for each in measured])
    means, spreads = values.mean(axis=0), values.std(axis=0)
    return {
        "writer": writer,
        "grounded": grounded,
        **{name: round(float(mean), 4) for name, mean in zip(MEASURES, means, strict=True)},
        "sd": {name: round(float(sd), 4) for name, sd in zip(MEASURES, spreads, strict=True)},
        "paper": PAPER[writer].to_dict(),
    }


def _line(row: Mapping[str, Any]) -> str:
    ours = "  ".join(f"{name.upper()} {row[name]:.3f}" for name in MEASURES)
    theirs = " ".join(f"{row['paper'][name]:.3f}" for name in MEASURES)
    kind = "grounded" if row["grounded"] else "raw"
    return f"{row['writer']:<10}{kind:<10}{ours}   paper: {theirs}"


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
