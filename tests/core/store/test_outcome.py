"""What was injected beside what was diagnosed: one line, and one mark, wherever both are known."""

from dataclasses import replace

import pytest

from core.diagnosis.outcome import Outcome, injected_faults
from core.fmea.catalogue import catalogue
from core.fmea.fault import Fault
from core.store.outcome import run_outcome
from core.store.records import RunRecord, new_run_id
from core.twin.actions import Action, Repair, SetFault, SetTarget
from core.twin.flight import fly_pair
from core.twin.plan import Plan

FAILURE = Fault("engine_failure", 0.9, 60.0)


def outcome(
    diagnosed: str,
    fault: Fault = FAILURE,
    *actions: Action,
    flown_s: float = 300.0,
    none_of_these: bool = False,
) -> Outcome:
    return Outcome(injected_faults(fault, actions, flown_s), diagnosed, none_of_these)


@pytest.mark.parametrize(
    ("given", "line"),
    [
        (
            outcome("engine_failure"),
            "Injected: Engine failure. Diagnosed: Engine failure. ✓ right",
        ),
        (outcome("nominal"), "Injected: Engine failure. Diagnosed: Nominal. ✗ wrong"),
        (outcome("nominal", Fault()), "Injected: Nominal. Diagnosed: Nominal. ✓ right"),
        (
            outcome("baffle_crack", Fault()),
            "Injected: Nominal. Diagnosed: Baffle crack. ✗ wrong",
        ),
        # Severity 0 equals nominal exactly.
        (
            outcome("nominal", replace(FAILURE, severity=0.0)),
            "Injected: Nominal. Diagnosed: Nominal. ✓ right",
        ),
        (
            outcome("engine_failure", none_of_these=True),
            "Injected: Engine failure. Diagnosed: none of the known faults (nearest: Engine "
            "failure). – no verdict",
        ),
        (
            outcome("engine_failure", FAILURE, Repair(352.0), flown_s=600.0),
            "Injected: Engine failure (repaired at 5:52). Diagnosed: Engine failure. ✓ right",
        ),
        # It was broken: that it is mended by the end does not make the flight a healthy one.
        (
            outcome("nominal", FAILURE, Repair(352.0), flown_s=600.0),
            "Injected: Engine failure (repaired at 5:52). Diagnosed: Nominal. ✗ wrong",
        ),
        # Called off before it began.
        (
            outcome("nominal", FAILURE, Repair(30.0)),
            "Injected: Nominal. Diagnosed: Nominal. ✓ right",
        ),
        # The flight was over first.
        (
            outcome("nominal", replace(FAILURE, onset_s=400.0), flown_s=280.0),
            "Injected: Engine failure (from 6:40, after the end of the flight). Diagnosed: "
            "Nominal. ✓ right",
        ),
        (
            outcome("nominal", Fault(), SetFault(290.0, "baffle_crack"), flown_s=280.0),
            "Injected: Nominal. Diagnosed: Nominal. ✓ right",
        ),
    ],
)
def test_the_line_says_both_and_whether_they_agree(given: Outcome, line: str) -> None:
    assert given.line == line


def test_of_several_faults_each_has_its_times_and_the_one_named_counts() -> None:
    actions = (
        SetFault(96.0, "engine_failure", 0.9),
        SetTarget(120.0, altitude_ft=5000.0),
        Repair(352.0),
        SetFault(370.0, "baffle_crack", 0.7),
    )
    told = outcome("baffle_crack", Fault(), *actions, flown_s=600.0)
    assert told.line == (
        "Injected: Engine failure (1:36 to 5:52), Baffle crack (from 6:10). "
        "Diagnosed: Baffle crack. ✓ right, from 6:10"
    )
    assert replace(told, diagnosed="engine_failure").mark_words == "right, 1:36 to 5:52"
    assert replace(told, diagnosed="oil_cooler_maintenance").right is False
    assert replace(told, diagnosed="nominal").right is False


def test_another_severity_goes_on_and_another_fault_takes_its_place() -> None:
    regraded = injected_faults(FAILURE, [SetFault(90.0, "engine_failure", 0.4)], 300.0)
    assert [(each.onset_s, each.end_s) for each in regraded] == [(60.0, None)]
    elsewhere = injected_faults(
        Fault("cylinder_crack", 0.9, 60.0, 1), [SetFault(90.0, "cylinder_crack", 0.9, 2)], 300.0
    )
    assert [each.onset_s for each in elsewhere] == [60.0, 90.0]
    replaced = injected_faults(FAILURE, [SetFault(90.0, "baffle_crack", 0.4)], 300.0)
    assert [(each.mode, each.end) for each in replaced] == [
        ("engine_failure", "replaced"),
        ("baffle_crack", ""),
    ]
    off = injected_faults(FAILURE, [SetFault(90.0, "engine_failure", 0.0)], 300.0)
    assert [(each.end_s, each.end) for each in off] == [(90.0, "repaired")]


def test_a_long_list_stays_short() -> None:
    often = [
        action
        for at_s in range(100, 500, 100)
        for action in (SetFault(at_s, "baffle_crack"), Repair(at_s + 50.0))
    ]
    many = [SetFault(500.0 + at, mode) for at, mode in enumerate(list(catalogue())[1:])]
    words = outcome("nominal", Fault(), *often, *many, flown_s=900.0).injected_words
    assert words.startswith("Baffle crack (5 times, first 1:40 to 2:30), ")
    assert words.endswith("15 more")


@pytest.mark.parametrize("fault", [FAILURE, replace(FAILURE, severity=0.0), Fault()])
def test_what_is_said_to_have_been_active_is_what_the_twin_flew(fault: Fault) -> None:
    plan, actions = Plan(duration_s=120.0, seed=3), (Repair(20.0), SetFault(40.0, "baffle_crack"))
    for listed in ((), actions[:1], actions):
        pair = fly_pair(plan, fault, listed)
        said = any(each.was_active for each in injected_faults(fault, listed, plan.duration_s))
        assert bool((pair.residual != 0.0).any()) == said


def test_a_run_has_an_outcome_once_it_has_a_verdict() -> None:
    record = RunRecord(new_run_id(), "2026-11-23T06:15:00+00:00", "running", Plan(), FAILURE)
    assert run_outcome(record) is None
    done = run_outcome(replace(record, status="done", top="nominal", top_probability=0.541))
    assert done is not None and done.right is False
    assert done.to_dict()["right"] is False
