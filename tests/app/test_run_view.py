"""From the events of a run to what the page shows."""

import json
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from dash._utils import to_json

from app.kit.wiring import Update
from app.pages.fly import states
from app.pages.fly import view as run_view
from app.pages.fly.view import RunView
from app.pages.report.panel import whole_report
from core.channels import N_CHANNELS
from core.diagnosis.diagnosis import Diagnosis
from core.fmea.catalogue import class_ids
from core.fmea.fault import Fault
from core.jobs import events, worker
from core.jobs.extremes import Seconds
from core.report.case.case import open_case
from core.report.grounded import grounded_template
from core.store.records import RunRecord, new_run_id
from core.twin.flight import fly_pair
from core.twin.plan import Plan
from core.twin.trajectory import STATE_NAMES


def view_of(duration_s: float = 300.0, mode: str = "engine_failure") -> RunView:
    plan = Plan(duration_s=duration_s, seed=3)
    return RunView(
        RunRecord(new_run_id(), "2026-11-23T06:15:00+00:00", "queued", plan, Fault(mode, 0.8, 60.0))
    )


def samples(start: int, n: int) -> events.Samples:
    rng = np.random.default_rng(start)
    channels = rng.normal(50.0, 5.0, (2, n, N_CHANNELS)).astype(np.float32)
    states = np.zeros((n, len(STATE_NAMES)), dtype=np.float32)
    time_s = ((start + np.arange(n)) / 5.0).astype(np.float32)
    return events.Samples("r", start, time_s, channels[0], channels[1], states, states)


def shown(updates: Sequence[Update]) -> dict[tuple[str, str], Any]:
    """The last value of each property, as the page would have it."""
    return {(item.component_id, item.prop): item.value for item in updates}


def diagnosis() -> Diagnosis:
    classes = class_ids()
    shares = np.full(len(classes), 0.01, dtype=np.float32)
    shares[classes.index("engine_failure")] = 0.81
    over_time = np.tile(shares, (3, 1))
    return Diagnosis(
        classes, np.array([30.0, 35.0, 40.0]), over_time, shares, (), 60.0, "cnn", "lab"
    )


def test_opening_fills_the_form_unless_it_holds_the_run_already() -> None:
    view = view_of()
    assert shown(view.opening(fill_form=True))["field-fault", "value"] == "engine_failure"
    assert not any(item.component_id.startswith("field-") for item in view.opening(fill_form=False))


def test_samples_go_out_from_where_the_page_stands() -> None:
    view = view_of()
    first = shown(view.changes([events.Started("r", 1), samples(0, 25)]))["flight", "data"]
    assert first["start"] == 0
    view.taken = {"key": first["key"], "count": 25}
    assert shown(view.changes([samples(25, 25)]))["flight", "data"]["start"] == 25


def test_samples_that_the_page_has_missed_are_sent_again() -> None:
    view = view_of()
    first = shown(view.changes([samples(0, 25)]))["flight", "data"]
    view.taken = {"key": first["key"], "count": 0}
    assert shown(view.changes([samples(25, 25)]))["flight", "data"]["start"] == 0
    view.taken = {"key": "of another flight", "count": 50}
    assert shown(view.changes([samples(50, 25)]))["flight", "data"]["start"] == 0


def test_a_second_attempt_begins_with_empty_tiles_and_says_why() -> None:
    view = view_of()
    before = shown(view.changes([events.Started("r", 1), samples(0, 25)]))["flight", "data"]
    view.taken = {"key": before["key"], "count": 25}
    page = shown(view.changes([events.Started("r", 2), samples(0, 10)]))
    assert page["flight", "data"]["key"] != before["key"]
    assert page["flight", "data"]["start"] == 0
    assert "attempt 2" in str(page["alert", "children"])


def test_verdict_and_report_are_shown() -> None:
    view = view_of()
    report = grounded_template(open_case(diagnosis()))
    page = shown(view.changes([events.Diagnosed("r", diagnosis()), events.Reported("r", report)]))
    assert "Engine failure" in str(page["ranking-nodes", "data"])
    assert "81.0 %" in str(page["ranking-nodes", "data"])
    assert page["report-nodes", "data"] == whole_report(view.record.id, report)


def outcome_of(view: RunView, given: Diagnosis) -> Any:
    return json.loads(to_json(shown(view.diagnosed(given))["outcome", "children"]))


def words(tree: Any) -> str:
    """All that is read in a tree of plain components."""
    if isinstance(tree, dict):
        return words(tree["props"].get("children", ""))
    return "".join(map(words, tree)) if isinstance(tree, list) else str(tree)


@pytest.mark.parametrize(
    ("mode", "line", "right"),
    [
        ("engine_failure", "Injected: Engine failure. Diagnosed: Engine failure. ✓ right", "true"),
        ("baffle_crack", "Injected: Baffle crack. Diagnosed: Engine failure. ✗ wrong", "false"),
        ("nominal", "Injected: Nominal. Diagnosed: Engine failure. ✗ wrong", "false"),
    ],
)
def test_the_verdict_stands_beside_what_was_injected(mode: str, line: str, right: str) -> None:
    tree = outcome_of(view_of(mode=mode), diagnosis())
    assert words(tree) == line
    assert f'"data-right":"{right}"' in json.dumps(tree, separators=(",", ":"))


def test_a_refusal_is_no_wrong_answer() -> None:
    tree = outcome_of(view_of(), replace(diagnosis(), none_of_these=True))
    assert "Diagnosed: none of the known faults (nearest: Engine failure)" in words(tree)
    assert words(tree).endswith("– no verdict")


def test_nothing_is_said_of_it_before_there_is_a_verdict() -> None:
    view = view_of()
    page = shown([*view.opening(fill_form=False), *view.changes([samples(0, 150), window(150)])])
    assert page["outcome", "children"] is None
    assert shown(states.idle())["outcome", "children"] is None


@pytest.mark.parametrize(
    ("event", "status", "buttons"),
    [
        (events.Started("r", 1), "running", {"cancel"}),
        (events.Finished("r"), "done", {"again"}),
        (events.Cancelled("r"), "cancelled", {"again"}),
        (events.Failed("r", "the worker died", True), "failed", {"retry"}),
        (events.Failed("r", "it cannot be flown", False), "failed", {"again"}),
    ],
)
def test_only_buttons_that_do_something_are_shown(
    event: events.Event, status: str, buttons: set[str]
) -> None:
    page = shown(view_of().changes([event]))
    assert page["fly", "data-status"] == status
    assert {name for name in ("cancel", "again", "retry") if page[name, "display"] != "none"} == (
        buttons
    )
    if isinstance(event, events.Failed):
        assert event.message in str(page["alert", "children"])


def test_a_whole_run_sends_less_than_two_megabytes(monkeypatch: pytest.MonkeyPatch) -> None:
    """300 s in the most frames there can be: one a block, each with an answer."""
    monkeypatch.setattr(run_view.time, "monotonic", lambda: np.inf)
    plan, fault = Plan(seed=3), Fault("engine_run_rough", 0.8, 60.0)
    pair = fly_pair(plan, fault)
    view = view_of(mode="engine_run_rough")
    sent, seconds = 0, Seconds()
    for start in range(0, 1500, 25):
        block = pair[10 * start : 10 * (start + 25)]
        flown = worker._samples("r", block, seconds.push(block))
        page = shown(view.changes([flown, window(start)]))
        view.taken = {"key": page["flight", "data"]["key"], "count": start + 25}
        sent += len(to_json(list(page.values())))
    channels = pair.faulted.time_s, pair.faulted.channels, pair.mirror.channels
    whole = [*view.tiles(*channels), *view.strip(*channels), *view.happened(pair)]
    sent += len(to_json([item.value for item in whole]))
    assert sent < 2_000_000, f"{sent} bytes"


def window(start: int) -> events.Probabilities:
    shares = np.full(len(class_ids()), 0.005, dtype=np.float32)
    shares[[0, 1 + start % 4]] = 0.7, 0.21
    return events.Probabilities("r", start / 5.0, shares)


def test_limits_that_the_flight_crossed_are_listed() -> None:
    pair = fly_pair(Plan(seed=3), Fault("engine_overspeed", 1.0, 30.0))
    pair.faulted.channels[5000:6000, 9] = 2790.0
    page = shown(view_of(mode="engine_overspeed").happened(pair))
    text = str(page["flight-events", "children"])
    assert "Engine speed above 2700 rpm" in text
    assert "1:40 to 2:00" in text


def test_a_diagnosis_that_deserves_no_trust_says_so() -> None:
    notes = "diagnosis-notes", "children"
    sound = view_of()
    assert shown(sound.diagnosed(diagnosis()))[notes] == []

    unknown = shown(sound.diagnosed(replace(diagnosis(), none_of_these=True)))[notes]
    assert "None of these" in unknown[0].children

    plan = replace(sound.record.plan, conditions="field")
    elsewhere = RunView(replace(sound.record, plan=plan))
    (learnt,) = shown(elsewhere.diagnosed(diagnosis()))[notes]
    assert "lab flights" in learnt.children and "field flight" in learnt.children


def test_an_answer_stands_for_a_while_unless_the_flight_is_paused(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    view, chart = view_of(), ("probabilities", "figure")
    assert chart in shown(view.changes([samples(0, 150), window(150)]))
    assert chart not in shown(view.changes([samples(150, 25), window(175)]))
    paused = shown(view.changes([events.Paced("r", 10.0, True)]))
    assert len(paused["answers-track", "data"]["time_s"]) == 2
    view.changes([events.Paced("r", 10.0, False), window(200)])
    monkeypatch.setattr(run_view.time, "monotonic", lambda: np.inf)
    late = shown(view.changes([samples(175, 5)]))
    assert len(late["answers-track", "data"]["time_s"]) == 3
    assert chart not in shown(view.changes([samples(180, 5)]))


def test_a_flight_that_meets_the_ground_is_drawn_as_long_as_it_was_and_says_so() -> None:
    plan = Plan(2000.0, 90.0, duration_s=7200.0, seed=3)
    record = RunRecord(
        new_run_id(), "2026-11-23T06:15:00+00:00", "done", plan, Fault("engine_failure", 1.0, 10.0)
    )
    pair = fly_pair(plan, record.fault)
    ground_s = pair.ground_s
    assert ground_s is not None
    view = RunView(record)
    view.opening(fill_form=False)
    channels = pair.mirror.time_s, pair.faulted.channels, pair.mirror.channels
    page = shown([*view.tiles(*channels), *view.strip(*channels), *view.happened(pair)])
    assert page["flight", "data"]["duration_s"] == page["scrub", "max"] == ground_s
    assert page["stage", "children"] == f"{run_view.clock(ground_s)} of 2:00:00"
    strip = page[run_view.fly.STRIP_ID, "figure"]["layout"]["xaxis"]["range"]
    assert strip == run_view.heat_strip(*channels[:1], pair.residual, duration_s=ground_s,
                                        onset_s=10.0)["layout"]["xaxis"]["range"]  # fmt: skip
    first = page["flight-events", "children"].children[0].children
    assert first == (
        f"The flight ends at {run_view.clock(ground_s)}: the aircraft met the ground "
        "(sea level; no terrain is simulated)"
    )
    marks = page[run_view.LIMIT_MARKS_ID, "data"]["marks"]
    assert [mark["label"] for mark in marks if mark["channel"] == "ground"] == ["Meets the ground"]


def test_a_live_flight_that_meets_the_ground_is_drawn_as_long_as_it_was() -> None:
    view = view_of(600.0)
    page = shown(view.changes([events.Started("r", 1), samples(0, 1000), events.Finished("r")]))
    assert page["scrub", "max"] == pytest.approx(199.8)
    assert page["stage", "children"] == "3:20 of 10:00"
    page = shown(view_of(200.0).changes([samples(0, 1000), events.Finished("r")]))
    assert page["stage", "children"] == "3:20"
