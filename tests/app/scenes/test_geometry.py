"""Where things are drawn."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.scenes import geometry
from app.scenes.geometry import Poses
from app.theme import VERTICAL_SCALE
from core.twin.trajectory import STATE_INDEX, STATE_NAMES

BODY_NOSE, BODY_LEFT, BODY_TOP = np.eye(3)


def poses(**columns: list[float]) -> Poses:
    """Poses at 0, 1, 2 ... s; states not given are 0."""
    n = len(next(iter(columns.values())))
    states = np.zeros((n, len(STATE_NAMES)))
    for name, values in columns.items():
        states[:, STATE_INDEX[name]] = values
    return Poses.of(np.arange(float(n)), states)


def turned(pose: Poses, vector: np.ndarray) -> np.ndarray:
    """A body vector as seen in the drawn world: east, north, up."""
    w, *xyz = geometry.attitude(pose)[0]
    return vector + 2.0 * np.cross(xyz, np.cross(xyz, vector) + w * vector)


@pytest.mark.parametrize(
    ("heading", "nose"), [(0, (0, 1, 0)), (90, (1, 0, 0)), (180, (0, -1, 0)), (270, (-1, 0, 0))]
)
def test_the_nose_points_along_the_heading(heading: float, nose: tuple[int, ...]) -> None:
    pose = poses(heading_deg=[heading])
    np.testing.assert_allclose(turned(pose, BODY_NOSE), nose, atol=1e-12)
    np.testing.assert_allclose(turned(pose, BODY_TOP), (0, 0, 1), atol=1e-12)


def test_pitch_lifts_the_nose_and_roll_drops_the_right_wing() -> None:
    up = poses(pitch_deg=[10.0], heading_deg=[37.0])
    assert turned(up, BODY_NOSE)[2] == pytest.approx(np.sin(np.radians(10.0)))
    right_bank = poses(roll_deg=[20.0], heading_deg=[37.0])
    assert turned(right_bank, BODY_LEFT)[2] == pytest.approx(np.sin(np.radians(20.0)))


def test_drawn_world_is_kilometres_east_north_and_scaled_up() -> None:
    drawn = geometry.drawn_positions(
        poses(north_m=[2000.0], east_m=[-500.0], altitude_ft=[6000.0]), origin_ft=5000.0
    )
    np.testing.assert_allclose(drawn, [[-0.5, 2.0, 0.3048 * VERTICAL_SCALE]])


def test_a_turn_through_north_does_not_spin_the_aircraft() -> None:
    first = poses(heading_deg=[350.0, 358.0])
    later = poses(heading_deg=[6.0, 14.0])
    whole = first.joined(Poses(later.time_s + 2.0, later.values))
    np.testing.assert_allclose(whole.values[:, 5], [350.0, 358.0, 366.0, 374.0])
    assert whole.at(1.5).values[0, 5] == pytest.approx(362.0)


def test_poses_between_samples_are_interpolated_and_held_at_the_ends() -> None:
    track = poses(north_m=[0.0, 100.0, 300.0])
    found = track.at([-5.0, 0.5, 1.5, 99.0]).values[:, 0]
    np.testing.assert_allclose(found, [0.0, 50.0, 200.0, 300.0])


def test_thinning_keeps_both_ends() -> None:
    track = poses(north_m=list(np.arange(5000.0)))
    thin = track.thinned(100)
    assert len(thin) == 100
    assert (thin.values[0, 0], thin.values[-1, 0]) == (0.0, 4999.0)


@pytest.mark.parametrize(
    ("lowest", "floor"), [(5000.0, 4000.0), (4600.0, 4000.0), (4400.0, 3000.0), (300.0, 0.0)]
)
def test_the_grid_lies_on_a_round_altitude_below_the_flight(lowest: float, floor: float) -> None:
    assert geometry.floor_ft(lowest) == floor


@given(
    heading=st.floats(0.0, 360.0),
    sink_ft=st.floats(0.0, 3000.0),
    aspect=st.floats(0.5, 3.0),
    duration_s=st.floats(30.0, 7200.0),
)
def test_the_camera_shows_the_whole_flight_and_fills_the_view(
    heading: float, sink_ft: float, aspect: float, duration_s: float
) -> None:
    start = poses(heading_deg=[heading], altitude_ft=[5000.0])
    stage = geometry.expected_points(start, duration_s)
    stage[-1, 2] -= geometry.drawn_height(sink_ft, 0.0)
    camera = geometry.framed(stage, heading, aspect)
    assert geometry.in_view(camera, stage, aspect)
    across, up, _ = np.abs(camera.seen(stage)).T
    assert max(across.max() / aspect, up.max()) > 0.7
    assert camera.position[2] > camera.look_at[2], "the camera looks down on the flight"


def test_a_flight_runs_from_left_to_right() -> None:
    for heading in (0.0, 77.0, 191.0, 303.0):
        start = poses(heading_deg=[heading])
        stage = geometry.expected_points(start, 300.0)
        seen = geometry.framed(stage, heading).seen(stage)[:, 0]
        assert seen[:2].max() < seen[2:].min()


def test_dashes_leave_as_much_out_as_they_draw_and_rungs_join_equal_times() -> None:
    mirror = poses(north_m=list(np.arange(0.0, 6000.0, 60.0)))
    faulted = poses(north_m=list(np.arange(0.0, 5000.0, 50.0)))
    lengths = np.ptp(geometry.dashes(mirror, 0.0), axis=1)[:, 1]
    assert lengths.sum() == pytest.approx(5.94 / 2.0, rel=0.03)
    joined = geometry.rungs(faulted, mirror, 0.0)[:, :, 1]
    np.testing.assert_allclose(joined[:, 0], joined[:, 1] * 5.0 / 6.0)
