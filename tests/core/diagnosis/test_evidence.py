"""Evidence names the channels that moved, and only those."""

import numpy as np
import pytest

from core.channels import CHANNEL_INDEX, channel
from core.diagnosis.evidence import find_evidence
from core.twin.trajectory import Pair, Trajectory


def test_a_healthy_flight_gives_none(make_pair):
    assert find_evidence(make_pair(60.0)) == ((), None)


def test_a_step_is_found_where_it_is_and_as_large_as_it_is(make_pair):
    (evidence,), onset_s = find_evidence(make_pair(90.0, ("E1 CHT3", 4.0, 40.0, 90.0)))
    assert onset_s == pytest.approx(40.0)
    assert (evidence.channel, evidence.unit, evidence.direction) == ("E1 CHT3", "degF", "+")
    assert evidence.value == pytest.approx(4.0, abs=1e-4)
    assert evidence.sigma == pytest.approx(4.0 / np.hypot(0.025, 0.2), rel=1e-4)
    assert (evidence.start_s, evidence.onset_s) == (pytest.approx(40.0), pytest.approx(40.0))
    assert evidence.end_s == pytest.approx(89.98)


def test_strongest_first_with_directions(make_pair):
    evidence, onset_s = find_evidence(
        make_pair(
            90.0,
            ("E1 OilP", -1.0, 45.0, 90.0),
            ("E1 OilT", 10.0, 40.0, 90.0),
            ("E1 RPM", -60.0, 50.0, 90.0),
        )
    )
    assert onset_s == pytest.approx(40.0)
    assert [item.channel for item in evidence] == ["E1 OilT", "E1 RPM", "E1 OilP"]
    assert [item.direction for item in evidence] == ["+", "-", "-"]
    assert [item.sigma > 0 for item in evidence] == [True, False, False]
    assert [item.onset_s for item in evidence] == pytest.approx([40.0, 50.0, 45.0])


@pytest.mark.parametrize(
    "shifts",
    [
        pytest.param([("E1 CHT1", 0.9 * channel("E1 CHT1").sigma, 20, 90)], id="within noise"),
        pytest.param([("VSpd", 500.0, 20.0, 20.5)], id="half a second"),
        pytest.param(
            [("VSpd", 300.0, 20.0, 50.0), ("VSpd", -300.0, 50.0, 80.0)], id="swings about nothing"
        ),
    ],
)
def test_what_has_not_really_moved_is_left_out(make_pair, shifts):
    evidence, onset_s = find_evidence(make_pair(90.0, *shifts))
    assert evidence == ()
    assert onset_s == pytest.approx(20.0)


def test_evidence_reaches_to_the_end_of_the_flight(make_pair):
    """ux.md D5: a shift that grows for minutes was told as its mean over the first two."""
    pair = make_pair(400.0, ("E1 CHT1", 4.0, 20.0, 400.0), ("AltMSL", -90.0, 245.0, 400.0))
    altitude, head = find_evidence(pair)[0]
    assert (head.channel, head.end_s) == ("E1 CHT1", pytest.approx(399.98))
    assert (altitude.channel, altitude.end_s) == ("AltMSL", pytest.approx(399.98))


def _ramped(pair: Pair, rise_until_s: float) -> Pair:
    """The pair with an oil temperature that rises from 60 s on, up to 30 degF."""
    channels = pair.faulted.channels.copy()
    time_s = pair.faulted.time_s
    share = np.clip((time_s - 60.0) / (rise_until_s - 60.0), 0.0, 1.0)
    channels[:, CHANNEL_INDEX["E1 OilT"]] += np.float32(30.0) * share.astype(np.float32)
    return Pair(Trajectory(time_s, pair.faulted.states, channels), pair.mirror)


def test_the_value_is_what_a_channel_settles_at_and_when(make_pair):
    (oil,), _ = find_evidence(_ramped(make_pair(400.0), 200.0))
    assert oil.value == pytest.approx(30.0, abs=0.01)
    assert oil.settled_s == pytest.approx(200.0, abs=15.0)


def test_what_still_moves_has_not_settled(make_pair):
    (oil,), _ = find_evidence(_ramped(make_pair(400.0), 400.0))
    assert oil.value == pytest.approx(30.0 * (385.0 - 60.0) / 340.0, abs=0.1)
    assert oil.settled_s is None


def test_nothing_after_a_repair_is_evidence(make_pair):
    pair = make_pair(300.0, ("E1 CHT1", 4.0, 20.0, 150.0), ("E1 EGT2", 90.0, 200.0, 300.0))
    (head,), onset_s = find_evidence(pair, until_s=150.0)
    assert onset_s == pytest.approx(20.0)
    assert (head.channel, head.value) == ("E1 CHT1", pytest.approx(4.0, abs=1e-4))
    assert head.end_s == pytest.approx(149.98)


def test_the_same_flight_gives_the_same_evidence(make_pair):
    shifts = (("E1 CHT1", 4.0, 20.0, 60.0), ("E1 EGT1", 40.0, 20.0, 60.0))
    assert find_evidence(make_pair(60.0, *shifts)) == find_evidence(make_pair(60.0, *shifts))
