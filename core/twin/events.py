"""What a flight did that a pilot would report: limits exceeded, stall, loss of control, ground."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from core.channels import CHANNELS
from core.clock import DT_S
from core.twin.trajectory import GROUND_FT, Trajectory

STALL_ALPHA_DEG = 16.0
LOST_CONTROL_BANK_DEG = 60.0
LEAST_DURATION_S = 0.5
"""Shorter excursions are gusts and noise, not events."""


@dataclass(frozen=True, slots=True)
class FlightEvent:
    """One excursion: ``kind`` is ``stall``, ``lost_control`` or the channel's name.

    ``value`` is the worst value reached, in ``unit``; ``limit`` the line that was crossed. The kind
    ``ground`` is no excursion but the end of the flight, at one moment.
    """

    kind: str
    start_s: float
    end_s: float
    value: float
    limit: float
    unit: str


def flight_events(flight: Trajectory) -> tuple[FlightEvent, ...]:
    """Every excursion of at least half a second, and the ground, in the order of time."""
    events = [
        *_excursions("stall", flight, flight.state("alpha_deg"), STALL_ALPHA_DEG, "deg"),
        *_excursions(
            "lost_control", flight, np.abs(flight.state("roll_deg")), LOST_CONTROL_BANK_DEG, "deg"
        ),
    ]
    if (ground_s := flight.ground_s) is not None:
        events.append(FlightEvent("ground", ground_s, ground_s, GROUND_FT, GROUND_FT, "ft"))
    for channel in CHANNELS:
        low, high = channel.red
        values = flight.channel(channel.name).astype(np.float64)
        if high is not None:
            events += _excursions(channel.name, flight, values, high, channel.unit)
        if low is not None:
            events += _excursions_below(channel.name, flight, values, low, channel.unit)
    return tuple(sorted(events, key=lambda event: event.start_s))


def _excursions_below(
    kind: str, flight: Trajectory, values: NDArray[np.float64], limit: float, unit: str
) -> list[FlightEvent]:
    """Where ``values`` (n,) stay below ``limit`` long enough."""
    return [
        FlightEvent(event.kind, event.start_s, event.end_s, -event.value, limit, event.unit)
        for event in _excursions(kind, flight, -values, -limit, unit)
    ]


def _excursions(
    kind: str, flight: Trajectory, values: NDArray[np.float64], limit: float, unit: str
) -> list[FlightEvent]:
    """Where ``values`` (n,) stay above ``limit`` long enough."""
    above = np.concatenate([[False], values > limit, [False]])
    edges = np.flatnonzero(np.diff(above.astype(np.int8)))
    least = round(LEAST_DURATION_S / DT_S)
    return [
        FlightEvent(
            kind,
            float(flight.time_s[start]),
            float(flight.time_s[stop - 1]),
            float(values[start:stop].max()),
            limit,
            unit,
        )
        for start, stop in zip(edges[::2], edges[1::2], strict=True)
        if stop - start >= least
    ]
