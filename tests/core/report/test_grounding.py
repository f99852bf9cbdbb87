"""Evidence held against modes: textbook cases confirm, inverted ones contradict."""

from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from report_samples import any_evidence, evidence, ideal_evidence

from core.cylinders import CYLINDERS
from core.diagnosis.diagnosis import Evidence
from core.fmea.catalogue import class_ids
from core.knowledge.knowledge import ExpectedShift, knowledge
from core.report.case.findings import Verdict, cylinder_hit, examine, judge, strongest

FAULTS = [mode for mode in class_ids() if mode != "nominal"]
MODES = st.sampled_from(class_ids())
CYLINDER = st.sampled_from(CYLINDERS)

RISE = ExpectedShift("E1 CHT3", "+", 10.0, 35.0)
STILL = ExpectedShift("E1 CHT3", "0", 0.0, 2.0)
MAYBE = ExpectedShift("E1 CHT3", "~", 0.5, 4.0)


@pytest.mark.parametrize(
    ("expected", "value", "verdict"),
    [
        (RISE, 20.0, "agrees"),
        (RISE, 1.6, "agrees"),
        (RISE, 1.4, "faint"),
        (RISE, -1.4, "faint"),
        (RISE, -1.6, "conflicts"),
        (RISE, None, "missing"),
        (STILL, 3.9, "agrees"),
        (STILL, 4.1, "conflicts"),
        (STILL, -4.1, "conflicts"),
        (STILL, None, "quiet"),
        (MAYBE, 5.9, "agrees"),
        (MAYBE, 6.1, "conflicts"),
        (MAYBE, None, "quiet"),
        (None, 0.5, "unexplained"),
        (None, None, "quiet"),
    ],
)
def test_one_channel_by_hand(
    expected: ExpectedShift | None, value: float | None, verdict: Verdict
) -> None:
    """A mild rise is 10: faint below 1.5. One percent of the 400 degF gauge is 4."""
    item = None if value is None else evidence("E1 CHT3", value)
    assert judge(expected, item) == verdict


def test_lab_allows_a_nominal_flight_no_trace() -> None:
    assert judge(STILL, evidence("E1 CHT3", 3.1), gauge_share=0.0) == "conflicts"


@pytest.mark.parametrize("cylinder", CYLINDERS)
@pytest.mark.parametrize("mode", FAULTS)
def test_a_textbook_case_is_seen_to_its_last_step(mode: str, cylinder: int) -> None:
    finding = examine(knowledge()[mode], ideal_evidence(mode, cylinder), cylinder)
    assert finding.confirmed == finding.predicted
    assert finding.explains_all
    assert {step.verdict for step in finding.chain} <= {"seen", "no sensor"}


@pytest.mark.parametrize("cylinder", CYLINDERS)
@pytest.mark.parametrize("mode", FAULTS)
def test_the_inverted_case_contradicts_every_moving_step(mode: str, cylinder: int) -> None:
    inverted = [replace(item, value=-item.value) for item in ideal_evidence(mode, cylinder)]
    finding = examine(knowledge()[mode], inverted, cylinder)
    assert finding.confirmed == ()
    moving = [step for step in finding.chain if any(check.must_move for check in step.checks)]
    assert moving
    assert {step.verdict for step in moving} == {"contradicted"}


@pytest.mark.parametrize("mode", FAULTS)
def test_without_evidence_every_moving_step_is_not_seen(mode: str) -> None:
    finding = examine(knowledge()[mode], (), 1)
    assert len(finding.having("missing")) == len(finding.predicted) > 0
    for step in finding.chain:
        if any(check.must_move for check in step.checks):
            assert step.verdict == "not seen"


@pytest.mark.parametrize("cylinder", CYLINDERS)
@pytest.mark.parametrize("mode", [mode for mode in FAULTS if knowledge()[mode].names_cylinder])
def test_the_cylinder_hit_is_read_from_the_evidence(mode: str, cylinder: int) -> None:
    hit = cylinder_hit(ideal_evidence(mode, cylinder))
    assert hit is not None
    bank = {cylinder, {1: 3, 3: 1, 2: 4, 4: 2}[cylinder]}
    assert hit.cylinder in bank if mode == "baffle_tie_rod" else hit.cylinder == cylinder


def test_equal_heads_leave_the_cylinder_open() -> None:
    hit = cylinder_hit([evidence("E1 CHT1", 12.0), evidence("E1 CHT3", 12.0)])
    assert hit is not None
    assert not hit.clear
    assert {hit.cylinder, hit.runner_up} == {1, 3}


def test_without_probes_no_cylinder_is_named() -> None:
    assert cylinder_hit([evidence("E1 OilT", 20.0)]) is None
    assert cylinder_hit([]) is None


def test_one_hot_head_is_no_tie_rod_and_no_seal() -> None:
    """Signs alone would fit: the other probes did rise, but only by a trace."""
    crack = [evidence("E1 CHT1", 20.0), evidence("E1 CHT3", 2.0), evidence("E1 CHT2", 0.5)]
    assert examine(knowledge()["baffle_crack"], crack, 1).explains_all
    rod = examine(knowledge()["baffle_tie_rod"], crack, 1)
    assert [check.channel for check in rod.having("faint")] == ["E1 CHT3"]
    rivet = examine(knowledge()["baffle_rivet"], crack, 1)
    assert [check.channel for check in rivet.having("faint")] == ["E1 CHT2"]


def test_two_equal_heads_are_no_crack() -> None:
    """A mild tie rod stays within the trace that a crack leaves its mate, but not beside it."""
    pair = [evidence("E1 CHT1", 5.0), evidence("E1 CHT3", 5.0)]
    crack = examine(knowledge()["baffle_crack"], pair, 1)
    assert [check.channel for check in crack.having("conflicts")] == ["E1 CHT3"]
    assert examine(knowledge()["baffle_tie_rod"], pair, 1).explains_all


@settings(deadline=None)
@given(MODES, CYLINDER, st.lists(any_evidence(), max_size=30))
def test_every_moved_channel_gets_one_verdict(
    mode: str, cylinder: int, items: list[Evidence]
) -> None:
    finding = examine(knowledge()[mode], items, cylinder)
    names = [check.channel for check in finding.checks]
    assert len(names) == len(set(names))
    assert set(names) == {item.channel for item in items} | set(
        knowledge()[mode].signature(cylinder)
    )
    for check in finding.checks:
        assert (check.evidence is None) == (check.verdict in ("missing", "quiet"))
        assert (check.expected is None) == (check.verdict == "unexplained")
    assert [step.step for step in finding.chain] == list(knowledge()[mode].chain)


@settings(deadline=None)
@given(MODES, CYLINDER, st.lists(any_evidence(), max_size=30, unique_by=lambda item: item.sigma))
def test_the_order_of_evidence_does_not_matter(
    mode: str, cylinder: int, items: list[Evidence]
) -> None:
    entry = knowledge()[mode]
    assert examine(entry, items, cylinder) == examine(entry, items[::-1], cylinder)
    assert cylinder_hit(items) == cylinder_hit(items[::-1])


@settings(deadline=None)
@given(st.lists(any_evidence(), max_size=30))
def test_the_strongest_item_speaks_for_its_channel(items: list[Evidence]) -> None:
    best = strongest(items)
    assert best.keys() == {item.channel for item in items}
    assert all(best[item.channel].sigma >= item.sigma for item in items)


def test_a_step_takes_half_of_its_channels_to_be_seen() -> None:
    """The first moving step of the loose pipe needs three more exhausts, a head and three heads."""
    step = next(
        index
        for index, item in enumerate(knowledge()["intake_manifold_loose"].chain)
        if len(item.predictions(2)) == 7
    )
    warm = [evidence(f"E1 EGT{cylinder}", 20.0) for cylinder in (1, 3, 4)]
    pipe = knowledge()["intake_manifold_loose"]
    assert examine(pipe, warm, 2).chain[step].verdict == "not seen"
    warm.append(evidence("E1 CHT2", 8.0))
    assert examine(pipe, warm, 2).chain[step].verdict == "seen"
