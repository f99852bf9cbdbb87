"""The test flights behind a cell of a confusion matrix, flown again from the model's card.

A card holds the seeds of its test flights, and the same seed gives the same flight to the last bit:
so the flights need not be kept to be opened.
"""

from collections.abc import Mapping, Sequence
from functools import lru_cache
from typing import Any

import dash_mantine_components as dmc
from dash import dcc, html

from app.kit.addresses import run_path
from app.kit.attributes import attributes
from app.kit.words import mode_name, takes_cylinder
from core.clock import clock
from core.dataset.generate import DatasetSpec, PlannedRun, planned_runs
from core.errors import MirrorTwinError
from core.store.records import RunRecord

Card = Mapping[str, Any]

HINT = "Choose a cell, or a count in the list below, to open the flights behind it."


def matrix_id(card: Card) -> dict[str, str]:
    """Component id of a model's matrix."""
    return {"type": "confusion", "card": card["name"]}


def count_button(card: Card, true: str, said: str, count: int) -> dmc.Button:
    """The number of windows of one class diagnosed as another; opens the flights behind it."""
    return dmc.Button(
        str(count),
        id={"type": "confused", "card": card["name"], "true": true, "said": said},
        size="compact-xs",
        variant="subtle",
        **attributes(aria_label=f"{count} windows: show the flights"),
    )


def place(card: Card) -> html.Div:
    """Where the flights behind a cell are listed."""
    return html.Div(
        html.P(HINT, className="note"),
        id={"type": "cell-runs", "card": card["name"]},
        className="cell-runs",
        role="status",
    )


def flights(card: Card, true: str, said: str, records: Sequence[RunRecord]) -> list[Any]:
    """The flights behind a cell: those that the card names, else all of the class injected."""
    scores = card["scores"]["test_windows"]
    row = scores["confusion"][card["classes"].index(true)]
    count = row[card["classes"].index(said)]
    mistakes = scores.get("mistakes")
    try:
        runs = [run for run in test_runs(card) if run.fault.mode == true]
    except MirrorTwinError as error:
        return [html.P(f"The test flights of this card are not known: {error}", className="note")]
    head = f"{mode_name(true)} diagnosed as {mode_name(said)}" if true != said else (
        f"{mode_name(true)} recognised"
    )  # fmt: skip
    if mistakes is not None and true != said:
        seeds = {
            item["seed"] for item in mistakes if (item["true"], item["predicted"]) == (true, said)
        }
        runs = [run for run in runs if run.plan.seed in seeds]
        whose = f"{count} of {sum(row)} windows, in {len(runs)} of the test flights."
    else:
        whose = f"{count} of {sum(row)} windows, cut from these {len(runs)} test flights."
        if mistakes is None and true != said:
            whose += " The card does not say which: open one to see its diagnosis."
    return [
        html.H3(head, className="chart-title"),
        html.P(whose, className="note"),
        html.Ul([_flight(card, run, stored_run(run, records)) for run in runs]),
    ]


def _flight(card: Card, run: PlannedRun, stored: RunRecord | None) -> html.Li:
    fault = run.fault
    parts = [f"severity {fault.severity:.2f}", f"onset {clock(fault.onset_s)}"]
    if takes_cylinder(fault.mode):
        parts.append(f"cylinder {fault.target_cylinder}")
    parts.append(f"seed {run.plan.seed}")
    if fault.mode == "nominal":
        parts = parts[-1:]
    words = ", ".join(parts)
    if stored is not None:
        diagnosis = f": {mode_name(stored.top)}" if stored.top else ""
        return html.Li([words, " ", dcc.Link(f"Open{diagnosis}", href=run_path(stored.id))])
    return html.Li(
        [
            words,
            dmc.Button(
                "Fly it",
                id={"type": "fly-test", "card": card["name"], "run": run.id},
                size="compact-xs",
                variant="default",
                **attributes(aria_label=f"Fly it: {words}"),
            ),
        ]
    )


def stored_run(run: PlannedRun, records: Sequence[RunRecord]) -> RunRecord | None:
    """The newest stored run of the same plan and fault that came to an end."""
    return next(
        (
            record
            for record in records
            if record.status == "done"
            and not record.actions
            and (record.plan, record.fault) == (run.plan, run.fault)
        ),
        None,
    )


def test_runs(card: Card) -> tuple[PlannedRun, ...]:
    """The test flights of a model, drawn from the seeds on its card; raises `InputError`."""
    spec = card["data"]["spec"]
    return _drawn(tuple((name, tuple(v) if isinstance(v, list) else v) for name, v in spec.items()))


@lru_cache(maxsize=4)
def _drawn(spec: tuple[tuple[str, Any], ...]) -> tuple[PlannedRun, ...]:
    """The test flights that a specification draws; raises `InputError` if it is none."""
    return tuple(run for run in planned_runs(DatasetSpec(**dict(spec))) if run.split == "test")
