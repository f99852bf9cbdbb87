"""Positions of a camera that follows: behind the faulted aircraft, or beside both."""

from typing import Literal, get_args

import numpy as np

from app.scenes.geometry import FOV_RAD, Array, Camera, Poses, drawn_positions
from core.units import distance_words

View = Literal["whole", "chase", "side", "free"]
VIEWS: tuple[View, ...] = get_args(View)

_CHASE_SPANS, _CHASE_RISE = 6.5, 0.28
_SIDE_SPANS, _SIDE_GAPS, _SIDE_RISE = 7.0, 2.4, 0.06


def following(
    view: Literal["chase", "side"], faulted: Poses, mirror: Poses, origin_ft: float, span_km: float
) -> Camera:
    """The camera of a view for two poses (1, 6); ``span_km`` is the wingspan drawn.

    Chase looks ahead along the heading, from behind and above. Side looks across the track at the
    middle between both aircraft, from so far that both are seen.
    """
    here, there = (drawn_positions(pose, origin_ft)[0] for pose in (faulted, mirror))
    heading = np.radians(float(faulted.values[0, 5]))
    ahead = np.array([np.sin(heading), np.cos(heading), 0.0])
    if view == "chase":
        distance = _CHASE_SPANS * span_km
        return _camera(here - distance * (ahead - _CHASE_RISE * _UP), here + span_km * ahead)
    right = np.array([np.cos(heading), -np.sin(heading), 0.0])
    middle = (here + there) / 2.0
    gap = float(np.linalg.norm(here - there))
    distance = max(_SIDE_SPANS * span_km, _SIDE_GAPS * gap)
    return _camera(middle + distance * (right + _SIDE_RISE * _UP), middle)


_UP = np.array([0.0, 0.0, 1.0])


def _camera(position: Array, look_at: Array) -> Camera:
    (x, y, z), (u, v, w) = position.tolist(), look_at.tolist()
    return Camera((x, y, z), (u, v, w), FOV_RAD)


def apart_m(faulted: Poses, mirror: Poses) -> float:
    """The true distance between two poses (1, 6), however heights are drawn."""
    difference = faulted.values[0, :3] - mirror.values[0, :3]
    return float(np.linalg.norm(difference * [1.0, 1.0, 0.3048]))


def apart_words(distance_m: float) -> str:
    """A distance in both units, empty where there is none to speak of.

    >>> apart_words(0.4), apart_words(70.1)
    ('', '230 ft (70 m) apart')
    """
    return "" if distance_m < 1.0 else f"{distance_words(distance_m)} apart"
