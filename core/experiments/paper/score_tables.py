"""What Tables 1 to 4 have in common: their result, their lines and their picture."""

from collections.abc import Mapping, Sequence
from typing import Any

import plotly.graph_objects as go

from core.diagnosis.trainer import device_name
from core.experiments.drawing import BLUE, GREY, axis, finish
from core.experiments.paper.published import Row
from core.experiments.paper.trainings import Bench
from core.experiments.results import Result

NOT_RUN = "null where a cell was not run"


def score_result(
    table: str,
    bench: Bench,
    rows: Sequence[Row],
    settings: Mapping[str, Any],
    findings: Mapping[str, Any] | None = None,
    summary: tuple[str, ...] = (),
) -> Result:
    """The result of a table of scores: rows beside the paper's, and where they come from."""
    spec = bench.manifest.spec
    return Result(
        name=f"{table}-{bench.conditions}",
        settings={
            "quick": bench.quick,
            "conditions": bench.conditions,
            "device": device_name(),
            "data": {"spec": spec, "code": bench.manifest.provenance},
            "scored_on": "windows of 30 s that tile the 120 s after each test fault first shows; "
            "the test split was read once for each cell",
            **settings,
        },
        findings={
            "conditions": bench.conditions,
            "missing": NOT_RUN,
            **(findings or {}),
            "rows": list(rows),
        },
        figure=_figure(rows),
        summary=(*map(_line, rows), *summary),
    )


def _line(row: Row) -> str:
    ours, theirs = _printed(row["macro_f1"]), _printed(row["paper_macro_f1"])
    spread = row.get("macro_f1_sd")
    around = f" ± {spread:.3f}" if spread is not None else ""
    return f"{row['scheme']:<42} macro-F1 {ours}{around}   paper: {theirs}"


def _printed(value: float | None) -> str:
    return "  -  " if value is None else f"{value:.3f}"


def _figure(rows: Sequence[Row]) -> go.Figure:
    """Macro-F1 by scheme, ours beside the paper's; what was not run is left out."""
    figure = go.Figure()
    schemes = [row["scheme"] for row in rows]
    for name, title, colour in (("macro_f1", "ours", BLUE), ("paper_macro_f1", "paper", GREY)):
        spread = name == "macro_f1" and any(row.get("macro_f1_sd") is not None for row in rows)
        figure.add_bar(
            y=schemes,
            x=[row[name] for row in rows],
            name=title,
            orientation="h",
            marker_color=colour,
            error_x={"array": [row.get("macro_f1_sd") for row in rows]} if spread else None,
        )
    figure.update_xaxes(axis("Macro-F1", range=[0, 1.02]))
    figure.update_yaxes(axis(autorange="reversed", showgrid=False))
    return finish(
        figure, 900, 170 + 46 * len(rows), barmode="group",
        margin={"l": 300, "r": 30, "t": 60, "b": 60},
    )  # fmt: skip
