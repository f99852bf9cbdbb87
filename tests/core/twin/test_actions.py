"""Acting on a flight: what a fault, a repair and a new target do, and to which of the two."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from core.channels import CHANNEL_INDEX
from core.errors import InputError
from core.fmea.fault import Fault
from core.twin.actions import (
    MAX_ACTIONS,
    Action,
    Repair,
    SetFault,
    SetTarget,
    action_to_dict,
    commanded,
    first_fault,
    in_order,
    load_actions,
    read_action,
)
from core.twin.flight import PairFlight, fly_pair
from core.twin.plan import Leg, Plan
from core.twin.trajectory import Pair

PLAN = Plan(duration_s=60.0, seed=11)
HEALTHY = Fault("nominal")
MODES = ["engine_run_rough", "baffle_crack", "cylinder_compression", "oil_cooler_maintenance"]

times_s = st.floats(0.0, 39.0)
an_action: st.SearchStrategy[Action] = st.one_of(
    st.builds(SetFault, times_s, st.sampled_from(MODES), st.floats(0.0, 1.0)),
    st.builds(Repair, times_s),
    st.builds(SetTarget, times_s, st.floats(4000.0, 6000.0), st.floats(90.0, 110.0)),
)


def bytes_of(pair: Pair) -> tuple[bytes, bytes, bytes]:
    """Everything that two equal flights have in common."""
    faulted, mirror = pair.faulted, pair.mirror
    return faulted.channels.tobytes(), faulted.states.tobytes(), mirror.channels.tobytes()


def rows(time_s: float) -> int:
    """The number of samples before that time."""
    return round(time_s * 50)


def test_an_injected_fault_is_the_planned_one() -> None:
    for mode in MODES:
        planned = fly_pair(PLAN, Fault(mode, 0.8, 20.0))
        injected = fly_pair(PLAN, HEALTHY, [SetFault(20.0, mode, 0.8)])
        assert bytes_of(injected) == bytes_of(planned)


@pytest.mark.parametrize("mode", ["engine_run_rough", "baffle_crack"])
def test_the_residual_is_zero_before_the_fault_and_dies_away_after_the_repair(mode: str) -> None:
    plan = Plan(duration_s=240.0, seed=11)
    actions = [SetFault(30.0, mode, 0.9), Repair(90.0)]
    pair = fly_pair(plan, HEALTHY, actions)
    residual = np.abs(pair.residual)
    assert not residual[: rows(30.0)].any()
    assert residual[rows(30.0) : rows(31.0)].any()
    broken, mended = (residual[rows(at) : rows(at) + 500].mean(axis=0) for at in (79.0, 229.0))
    moved = broken > 0.05 * broken.max()
    assert (mended[moved] < 0.2 * broken[moved]).all()


@pytest.mark.parametrize("power", ["fixed", "speed_hold"])
def test_the_mirror_does_as_the_pilot_is_told_and_knows_of_no_fault(power: Any) -> None:
    plan = Plan(duration_s=120.0, seed=11, power=power)
    told = [SetTarget(20.0, altitude_ft=5200.0, speed_kt=95.0), SetTarget(60.0, heading_deg=40.0)]
    broken = [SetFault(30.0, "engine_run_rough", 0.9), Repair(70.0)]
    acted, spared = fly_pair(plan, HEALTHY, [*told, *broken]), fly_pair(plan, HEALTHY, told)
    assert acted.mirror.channels.tobytes() == spared.mirror.channels.tobytes()
    assert not spared.residual.any()
    end = spared.mirror[-1:]
    assert end.state("altitude_ft")[0] == pytest.approx(5200.0, abs=15.0)
    assert end.state("ias_kt")[0] == pytest.approx(95.0, abs=1.5)
    assert end.state("heading_deg")[0] == pytest.approx(40.0, abs=1.5)
    undisturbed = fly_pair(plan, HEALTHY).mirror.states[: rows(20.0)]
    assert acted.faulted.states[: rows(20.0)].tobytes() == undisturbed.tobytes()


def test_a_target_is_flown_as_a_leg_of_the_plan_is() -> None:
    told = fly_pair(PLAN, HEALTHY, [SetTarget(20.0, 5200.0, 95.0)]).mirror
    legged = fly_pair(Plan(duration_s=60.0, seed=11, legs=(Leg(20.0, 5200.0, 95.0),)), HEALTHY)
    assert np.abs(told.states - legged.mirror.states)[:, 2].max() < 0.5


def test_another_severity_goes_on_from_where_the_fault_has_come_to() -> None:
    first, second = SetFault(10.0, "baffle_crack", 0.9), SetFault(30.0, "baffle_crack", 0.3)
    regraded = fly_pair(PLAN, HEALTHY, [first, second]).residual
    worse, mild = (fly_pair(PLAN, HEALTHY, [one]).residual for one in (first, second))
    assert regraded[: rows(30.0)].tobytes() == worse[: rows(30.0)].tobytes()
    head = CHANNEL_INDEX["E1 CHT1"]
    at_end = [float(np.abs(each[-250:, head]).max()) for each in (mild, regraded, worse)]
    assert at_end[0] < at_end[1] < at_end[2]


def test_the_planned_fault_is_called_off() -> None:
    planned = Fault("engine_run_rough", 0.8, 40.0)
    assert not fly_pair(PLAN, planned, [Repair(20.0)]).residual.any()
    other = SetFault(20.0, "baffle_crack", 0.7)
    assert bytes_of(fly_pair(PLAN, planned, [other])) == bytes_of(fly_pair(PLAN, HEALTHY, [other]))
    assert not fly_pair(PLAN, HEALTHY, [SetFault(20.0, "engine_failure", 0.0)]).residual.any()


@settings(max_examples=25, deadline=None, suppress_health_check=list(HealthCheck))
@given(
    mode=st.sampled_from(["nominal", *MODES]),
    actions=st.lists(an_action, max_size=5),
    block_s=st.sampled_from([0.2, 1.7, 40.0]),
    conditions=st.sampled_from(["lab", "lab", "field"]),
)
def test_live_or_not_in_any_order_and_in_any_blocks_it_is_the_same_flight(
    mode: str, actions: list[Action], block_s: float, conditions: Any
) -> None:
    """What a live flight has done, done again in one go, gives the same bytes."""
    plan, fault = Plan(duration_s=40.0, seed=3, conditions=conditions), Fault(mode, 0.7, 15.0)
    flight, blocks, done = PairFlight(plan, fault, live=True), [], []
    to_do = list(actions)
    while (block := flight.advance(block_s)) is not None:
        blocks.append(block)
        if to_do and flight.progress < 1.0:
            done.append(flight.act(to_do.pop(0)))
            assert done[-1].time_s >= flight.flown_s
    live = Pair.joined(blocks)
    assert bytes_of(fly_pair(plan, fault, done)) == bytes_of(live)
    told = [action for action in done if isinstance(action, SetTarget)]
    alone = fly_pair(plan, HEALTHY, told).mirror
    assert alone.channels.tobytes() == live.mirror.channels.tobytes()
    start = first_fault(fault, done)
    if conditions == "lab":
        until = plan.duration_s if start is None else start.onset_s
        assert not live.residual[: rows(until)].any()


@given(st.lists(an_action, max_size=6))
def test_actions_can_be_written_and_read(actions: list[Action]) -> None:
    listed = json.loads(json.dumps([action_to_dict(action) for action in actions]))
    assert [read_action(values) for values in listed] == actions


def test_what_the_crew_was_told_is_a_plan() -> None:
    plan = Plan(legs=(Leg(20.0, altitude_ft=5500.0), Leg(50.0, heading_deg=90.0)))
    told = commanded(plan, [SetTarget(49.97, speed_kt=90.0), Repair(10.0), SetTarget(30.0, 4000.0)])
    assert told.legs == (
        Leg(20.0, altitude_ft=5500.0),
        Leg(30.0, altitude_ft=4000.0),
        Leg(50.0, speed_kt=90.0, heading_deg=90.0),
    )


def test_the_first_fault_is_the_one_that_sets_in_first() -> None:
    planned = Fault("baffle_crack", 0.6, 60.0)
    assert first_fault(planned, []) == planned
    assert first_fault(planned, [Repair(30.0)]) is None
    assert first_fault(planned, [Repair(90.0)]) == planned
    injected = SetFault(30.0, "engine_failure", 0.5)
    assert first_fault(planned, [injected]) == Fault("engine_failure", 0.5, 30.0)
    assert first_fault(HEALTHY, [Repair(10.0), injected]) == Fault("engine_failure", 0.5, 30.0)


@pytest.mark.parametrize(
    ("values", "field"),
    [
        ({"kind": "fault", "time_s": -1.0, "mode": "baffle_crack"}, "time_s"),
        ({"kind": "fault", "time_s": 10.0, "mode": "nominal"}, "fault"),
        ({"kind": "fault", "time_s": 10.0, "mode": "nonsense"}, "fault"),
        ({"kind": "fault", "time_s": 10.0, "mode": "baffle_crack", "severity": 2}, "severity"),
        ({"kind": "fault", "time_s": 10.0, "mode": "baffle_crack", "cylinder": 7}, "cylinder"),
        ({"kind": "fault", "time_s": 10.0}, "mode"),
        ({"kind": "repair"}, "time_s"),
        ({"kind": "repair", "time_s": "soon"}, "time_s"),
        ({"kind": "target", "time_s": 10.0}, "target"),
        ({"kind": "target", "time_s": 10.0, "altitude_ft": 90_000}, "altitude_ft"),
        ({"kind": "target", "time_s": 10.0, "flaps": 10}, "flaps"),
        ({"kind": "eject", "time_s": 10.0}, "kind"),
        ({"time_s": 10.0}, "kind"),
        ("repair", "actions"),
    ],
)
def test_what_cannot_be_done_is_named(values: Any, field: str) -> None:
    with pytest.raises(InputError) as caught:
        read_action(values)
    assert caught.value.field == field


def test_nothing_can_be_done_after_the_end() -> None:
    with pytest.raises(InputError, match="time_s: must lie in 0 to 60 s"):
        fly_pair(PLAN, HEALTHY, [Repair(60.0)])
    flight = PairFlight(PLAN, HEALTHY, live=True)
    flight.advance(60.0)
    with pytest.raises(InputError, match="before the end"):
        flight.act(Repair(5.0))
    with pytest.raises(InputError, match="500 at most"):
        in_order([Repair(1.0)] * (MAX_ACTIONS + 1), PLAN)


def test_actions_are_read_from_toml_and_json(tmp_path: Path) -> None:
    toml, as_json, bad = tmp_path / "a.toml", tmp_path / "a.json", tmp_path / "b.toml"
    toml.write_text('[[actions]]\nkind = "repair"\ntime_s = 30\n')
    as_json.write_text('{"actions": [{"kind": "repair", "time_s": 30}]}')
    bad.write_text("actions = 3")
    assert load_actions(toml) == load_actions(as_json) == (Repair(30.0),)
    for path in (bad, tmp_path / "none.toml", Path(__file__)):
        with pytest.raises(InputError, match="actions"):
            load_actions(path)
