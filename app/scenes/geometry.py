"""From flight states to drawn geometry: the same for viser and for Rerun. Pure functions.

The drawn world is east, north, up in kilometres, origin where the flight starts. Heights are
drawn `VERTICAL_SCALE` times: over a 15 km flight a real difference of 200 ft would otherwise be two
pixels. The scale is the same in every run, so that two runs can be compared by eye.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from app.theme import VERTICAL_SCALE
from core.twin.plan import Plan
from core.twin.trajectory import STATE_INDEX, Trajectory

Array = NDArray[np.float64]

KM_PER_FT = 0.0003048
_CRUISE_KMPS = 0.055
_DASH_S, _RUNG_S = 2.5, 10.0
_GAP_COLUMNS = 160
DRAWN_RATE_HZ = 5.0
"""Poses kept a second of flight: between them the aircraft is interpolated."""

_POSE_STATES = ("north_m", "east_m", "altitude_ft", "roll_deg", "pitch_deg", "heading_deg")
_POSE_COLUMNS = [STATE_INDEX[name] for name in _POSE_STATES]


@dataclass(frozen=True, slots=True, eq=False)
class Poses:
    """One aircraft over time. ``time_s``: (n,). ``values``: (n, 6), in `_POSE_STATES` order.

    Headings are unwrapped, so that interpolating through north does not spin the aircraft.
    """

    time_s: Array
    values: Array

    @staticmethod
    def of(time_s: ArrayLike, states: ArrayLike) -> "Poses":
        """Pick the pose out of states (n, len(STATE_NAMES))."""
        values = np.asarray(states, dtype=np.float64)[:, _POSE_COLUMNS]
        values[:, 5] = np.unwrap(values[:, 5], period=360.0)
        return Poses(np.asarray(time_s, dtype=np.float64), values)

    @staticmethod
    def of_flight(flight: Trajectory) -> "Poses":
        """The poses of a whole flight, thinned to `DRAWN_RATE_HZ`; the last is always there."""
        n = len(flight)
        step = 1
        if n > 1:
            rate_hz = (n - 1) / (flight.time_s[-1] - flight.time_s[0])
            step = max(1, round(rate_hz / DRAWN_RATE_HZ))
        rows = np.unique(np.append(np.arange(0, n, step), n - 1))
        return Poses.of(flight.time_s[rows], flight.states[rows])

    @staticmethod
    def start(plan: Plan) -> "Poses":
        """Where a plan begins."""
        values = [[0.0, 0.0, plan.altitude_ft, 0.0, 0.0, plan.heading_deg]]
        return Poses(np.zeros(1), np.array(values))

    def joined(self, later: "Poses") -> "Poses":
        """These poses and the ones that follow them."""
        values = later.values.copy()
        turns = np.round((self.values[-1, 5] - values[0, 5]) / 360.0) if len(values) else 0.0
        values[:, 5] += 360.0 * turns
        return Poses(
            np.concatenate([self.time_s, later.time_s]), np.concatenate([self.values, values])
        )

    def __len__(self) -> int:
        """Number of poses."""
        return len(self.time_s)

    def at(self, times_s: ArrayLike) -> "Poses":
        """The poses at given times, interpolated; outside the flight, its nearest end."""
        times = np.atleast_1d(np.asarray(times_s, dtype=np.float64))
        columns = [np.interp(times, self.time_s, column) for column in self.values.T]
        return Poses(times, np.stack(columns, axis=1))

    def thinned(self, most: int) -> "Poses":
        """At most ``most`` + 1 poses, first and last among them."""
        n = len(self)
        if n <= most:
            return self
        rows = np.unique(np.linspace(0, n - 1, most).round().astype(int))
        return Poses(self.time_s[rows], self.values[rows])


def drawn_height(altitude_ft: ArrayLike, origin_ft: float) -> Array:
    """Drawn height [km] of an altitude above the origin's."""
    height = np.asarray(altitude_ft, dtype=np.float64) - origin_ft
    scaled: Array = height * (KM_PER_FT * VERTICAL_SCALE)
    return scaled


def drawn_positions(poses: Poses, origin_ft: float) -> Array:
    """Drawn positions (n, 3) [km east, km north, scaled km up]."""
    north_km, east_km = poses.values[:, 0] / 1000.0, poses.values[:, 1] / 1000.0
    return np.stack([east_km, north_km, drawn_height(poses.values[:, 2], origin_ft)], axis=1)


def attitude(poses: Poses) -> Array:
    """Unit quaternions (n, 4), wxyz, from the body (x forward, y left, z up) to east-north-up.

    Roll, pitch and heading are the usual aircraft angles (Stevens and Lewis, section 1.3): yaw
    by 90 degrees - heading, then nose up by pitch, then right wing down by roll.
    """
    roll, pitch, heading = np.radians(poses.values[:, 3:6].T)
    yaw, dive = np.pi / 2.0 - heading, -pitch
    cr, sr = np.cos(roll / 2.0), np.sin(roll / 2.0)
    cp, sp = np.cos(dive / 2.0), np.sin(dive / 2.0)
    cy, sy = np.cos(yaw / 2.0), np.sin(yaw / 2.0)
    return np.stack(
        [
            cr * cp * cy + sr * sp * sy,
            sr * cp * cy - cr * sp * sy,
            cr * sp * cy + sr * cp * sy,
            cr * cp * sy - sr * sp * cy,
        ],
        axis=1,
    )


def floor_ft(lowest_ft: float) -> float:
    """Altitude of the grid: the round 1,000 ft at least 500 ft under the lowest point, or MSL."""
    return max(0.0, float(np.floor((lowest_ft - 500.0) / 1000.0)) * 1000.0)


def segments(points: Array) -> Array:
    """A polyline (n, 3) as line segments (n - 1, 2, 3)."""
    return np.stack([points[:-1], points[1:]], axis=1)


def lowest_ft(faulted: Poses, mirror: Poses) -> float:
    """The lowest altitude of both flights."""
    return float(min(faulted.values[:, 2].min(), mirror.values[:, 2].min()))


def _pace(last_s: float) -> float:
    """How much sparser dashes and rungs are in a flight of this length than in one of 300 s."""
    return max(1.0, float(np.ceil(last_s / 300.0)))


def dashes(poses: Poses, origin_ft: float) -> Array:
    """The path as dashes (n, 2, 3), so that another path stays visible where both coincide."""
    last_s = float(poses.time_s[-1])
    length_s = _DASH_S * _pace(last_s)
    starts = np.arange(0.0, last_s, 2.0 * length_s)
    ends = [poses.at(starts), poses.at(np.minimum(starts + length_s, last_s))]
    return np.stack([drawn_positions(end, origin_ft) for end in ends], axis=1)


def rungs(faulted: Poses, mirror: Poses, origin_ft: float) -> Array:
    """Lines (n, 2, 3) between where both aircraft are at equal times."""
    last_s = float(mirror.time_s[-1])
    times = np.arange(0.0, last_s, _RUNG_S * _pace(last_s))
    ends = [drawn_positions(flight.at(times), origin_ft) for flight in (faulted, mirror)]
    return np.stack(ends, axis=1)


Surface = tuple[Array, NDArray[np.uint32]]
"""Vertices (n, 3) and faces (m, 3)."""


def gap(faulted: Poses, mirror: Poses, origin_ft: float) -> Surface:
    """The surface that the rungs span: vertices (2 k, 3) and faces (2 k - 2, 3)."""
    times = np.linspace(0.0, float(mirror.time_s[-1]), _GAP_COLUMNS)
    sides = [drawn_positions(flight.at(times), origin_ft) for flight in (faulted, mirror)]
    return np.concatenate(sides), _strip_faces(_GAP_COLUMNS)


def curtain(flight: Poses, origin_ft: float, floor_km: float) -> Surface:
    """The surface that hangs from a path down to the ground, likewise."""
    times = np.linspace(0.0, float(flight.time_s[-1]), _GAP_COLUMNS)
    top = drawn_positions(flight.at(times), origin_ft)
    foot = np.column_stack([top[:, :2], np.full(len(top), floor_km)])
    return np.concatenate([top, foot]), _strip_faces(_GAP_COLUMNS)


def _strip_faces(columns: int) -> NDArray[np.uint32]:
    """The triangles between two rows of that many vertices each."""
    here = np.arange(columns - 1)
    there = here + columns
    faces = np.concatenate([
        np.stack([here, here + 1, there], axis=1),
        np.stack([here + 1, there + 1, there], axis=1),
    ])  # fmt: skip
    return faces.astype(np.uint32)


@dataclass(frozen=True, slots=True)
class Camera:
    """Where to look from: positions in the drawn world [km], vertical field of view [rad]."""

    position: tuple[float, float, float]
    look_at: tuple[float, float, float]
    fov: float

    @property
    def distance(self) -> float:
        """From the camera to what it looks at [km]."""
        return float(np.linalg.norm(np.subtract(self.position, self.look_at)))

    def seen(self, points: Array) -> Array:
        """Where points (n, 3) appear: (n, 3), right and up in half view heights, and depth [km].

        Without perspective roll: up in the picture is up in the world.
        """
        back = np.subtract(self.position, self.look_at) / self.distance
        right = np.cross([0.0, 0.0, 1.0], back)
        right /= np.linalg.norm(right)
        offset = points - np.array(self.position)
        depth = -(offset @ back)
        half = np.tan(self.fov / 2.0) * depth
        return np.stack(
            [offset @ right / half, offset @ np.cross(back, right) / half, depth], axis=1
        )


ASPECT = 1.6
"""Width over height of a view that has not said its own."""

FOV_RAD = 0.6
_FILL_ACROSS, _FILL_UP = 0.8, 0.88  # labels stick out sideways


def in_view(camera: Camera, points: Array, aspect: float = ASPECT) -> bool:
    """Whether the camera shows all ``points`` (n, 3)."""
    right, up, depth = camera.seen(points).T
    return bool(np.all((np.abs(right) < aspect) & (np.abs(up) < 1.0) & (depth > 0.0)))


def framed(
    points: Array, heading_deg: float, aspect: float = ASPECT, fov: float = FOV_RAD
) -> Camera:
    """A camera from the right of the track that shows all ``points`` (n, 3) with a margin.

    From there the flight runs left to right, as time does on the plots, and heights read as
    heights; turned a little to the front, so that the end with the aircraft is the near one.
    """
    toward, elevation = np.radians(heading_deg + 90.0 - 36.0), np.radians(12.0)
    back = np.array([
        np.cos(elevation) * np.sin(toward), np.cos(elevation) * np.cos(toward), np.sin(elevation),
    ])  # fmt: skip
    right = np.cross([0.0, 0.0, 1.0], back)
    right /= np.linalg.norm(right)
    up = np.cross(back, right)
    half = np.tan(fov / 2.0)
    target, distance = points.mean(axis=0), 0.0
    for _ in range(8):  # centre and distance depend on each other; this settles
        offset = points - target
        across, upward, toward_eye = offset @ right, offset @ up, offset @ back
        wide, high = np.abs(across) / (aspect * _FILL_ACROSS), np.abs(upward) / _FILL_UP
        needed = np.maximum(wide, high) / half + toward_eye
        distance = float(needed.max())
        seen_across, seen_up = across / (distance - toward_eye), upward / (distance - toward_eye)
        target = target + distance / 2.0 * (
            right * (seen_across.max() + seen_across.min()) + up * (seen_up.max() + seen_up.min())
        )
    return Camera(_triple(target + back * distance), _triple(target), fov)


def _triple(vector: Array) -> tuple[float, float, float]:
    return float(vector[0]), float(vector[1]), float(vector[2])


def expected_points(start: Poses, duration_s: float) -> Array:
    """Corners of where a flight from a start pose (1, 6) will take place if it goes straight.

    In the drawn world, (4, 3). Leaves room below for a fault that costs 1,000 ft, so that the
    view need not change under the viewer for most faults.
    """
    heading = np.radians(start.values[0, 5])
    here = drawn_positions(start, float(start.values[0, 2]))[0]
    ahead = _CRUISE_KMPS * duration_s * np.array([np.sin(heading), np.cos(heading), 0.0])
    heights = np.array([[0.0, 0.0, z] for z in drawn_height([-1000.0, 100.0], 0.0)])
    return np.concatenate([here + heights, here + ahead + heights])


def wingspan_km(camera: Camera) -> float:
    """The drawn wingspan: an eighth of the view's height. At true scale it would be a pixel."""
    return float(2.0 * np.tan(camera.fov / 2.0) * camera.distance) / 8.0
