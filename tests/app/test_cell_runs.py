"""The test flights behind a cell of a confusion matrix."""

import json
from dataclasses import replace
from typing import Any

import pytest

from app.pages.results import cell_runs
from core.dataset.generate import DatasetSpec, planned_runs
from core.experiments.stored import model_cards
from core.store.records import RunRecord


@pytest.fixture(scope="module")
def card() -> Any:
    cards = model_cards()
    if not cards:
        pytest.skip("no model is shipped")
    return cards[0]


def told(card: Any, true: str, said: str, records: list[RunRecord]) -> str:
    parts = cell_runs.flights(card, true, said, records)
    return json.dumps(parts, default=lambda item: item.to_plotly_json(), ensure_ascii=False)


def test_a_cell_lists_the_very_flights_that_the_card_was_scored_on(card: Any) -> None:
    spec = DatasetSpec(**card["data"]["spec"])
    wanted = [
        run for run in planned_runs(spec) if run.split == "test" and run.fault.mode == "baffle_plug"
    ]
    text = told(card, "baffle_plug", "baffle_plug", [])
    assert text.count('"Fly it"') == len(wanted) > 0
    assert all(f"seed {run.plan.seed}" in text for run in wanted)
    assert not {run.plan.seed for run in wanted} & set(card["data"]["seeds"]["train"])
    older = with_mistakes(card, None)
    assert "The card does not say which" in told(older, "baffle_plug", "baffle_crack", [])


def with_mistakes(card: Any, mistakes: Any) -> Any:
    """The card, its mistakes others than they were."""
    windows = {**card["scores"]["test_windows"], "mistakes": mistakes}
    return {**card, "scores": {**card["scores"], "test_windows": windows}}


def test_where_the_card_names_them_only_those_are_listed(card: Any) -> None:
    run = next(run for run in cell_runs.test_runs(card) if run.fault.mode == "baffle_plug")
    item = {"true": "baffle_plug", "predicted": "baffle_crack", "seed": run.plan.seed}
    text = told(with_mistakes(card, [item]), "baffle_plug", "baffle_crack", [])
    assert text.count('"Fly it"') == 1
    assert "in 1 of the test flights" in text


def test_a_flight_that_is_stored_is_opened_and_not_flown_again(card: Any) -> None:
    run = next(run for run in cell_runs.test_runs(card) if run.fault.mode == "nominal")
    record = RunRecord(
        "20261123T061500-k3x9q2wz", "2026-11-23T06:15:00+00:00", "done", run.plan, run.fault,
        top="baffle_crack", top_probability=0.5,
    )  # fmt: skip
    text = told(card, "nominal", "nominal", [record])
    assert f"/run/{record.id}" in text and "Open: Baffle crack" in text
    text = told(card, "nominal", "nominal", [replace(record, status="failed")])
    assert record.id not in text
