"""Whether every fault moves every channel the way, and as far as, engineers say it does.

For each mode, plans from the paper's cruise box (section 3.1) and severities 0.3, 0.8 and 1.0 on
the mode's usual cylinder, in lab conditions with the throttle left alone and altitude held by
pitch: the control mode that the reference (`core.experiments.signs.signatures`) assumes. A shift
is the paired residual averaged over a window and then over the plans. It has to exceed the sigma of
its channel to count, and no shift is whatever stays below it.
"""

from collections.abc import Callable, Iterable, Mapping
from typing import Any

import numpy as np

from core.arrays import Array
from core.channels import CHANNEL_INDEX, channel
from core.clock import DT_S
from core.experiments.results import Progress, Result
from core.experiments.signs.figure import draw
from core.experiments.signs.rows import Row
from core.experiments.signs.signatures import (
    Dispute,
    Expected,
    Signatures,
    WindowKind,
    signatures,
)
from core.fmea.fault import Fault
from core.twin.flight import fly
from core.twin.plan import Plan

SIGNS_SEVERITIES: tuple[float, ...] = (0.3, 0.8, 1.0)
CLEAR = 0.8
"""The severity at which signs are judged; ranges are judged at all of `SIGNS_SEVERITIES`."""

SIGNS_ONSET_S = 30.0
SIGNS_WINDOW_S = 60.0
PLANS, QUICK_PLANS = 6, 1


def run(quick: bool, progress: Progress) -> Result:
    """Fly all modes and judge all entries; raises `FlightError`."""
    reference = signatures()
    plans = [Plan.sampled(seed) for seed in range(QUICK_PLANS if quick else PLANS)]
    shifts = fly_shifts(plans, reference.expected, SIGNS_SEVERITIES, progress)
    rows = judge(reference, shifts)
    counted = [row for row in rows if row.expected != "~"]
    held = [row for row in counted if row.held]
    within = [row for row in counted if row.within]
    return Result(
        name="signs",
        settings=_settings(plans, quick, reference),
        findings={
            "held": len(held),
            "of": len(counted),
            "magnitudes_within": len(within),
            "disputed": sum(row.disputed is not None for row in rows),
            "rows": [row.to_dict() for row in rows],
        },
        figure=draw(rows, reference.channels),
        summary=(
            f"signs held: {len(held)} of {len(counted)} ({len(rows) - len(counted)} make no claim)",
            f"shifts within their range at every severity: {len(within)} of {len(counted)}",
            *_complaints(counted),
        ),
    )


def fly_shifts(
    plans: Iterable[Plan],
    modes: Iterable[str],
    severities: Iterable[float],
    progress: Progress = lambda share: None,
) -> dict[str, dict[float, Array]]:
    """Shifts (plans, 23) of every mode and severity; raises `FlightError`.

    One mirror is flown a plan: in lab conditions it is the mirror of every pair.
    """
    flights = [(plan, fly(plan)) for plan in plans]
    jobs = [(mode, severity) for mode in modes for severity in severities]
    shifts: dict[str, dict[float, Array]] = {}
    for done, (mode, severity) in enumerate(jobs):
        fault = Fault(mode, severity, SIGNS_ONSET_S)
        measured = [
            shift(mode, fly(plan, fault).channels.astype(np.float64) - mirror.channels)
            for plan, mirror in flights
        ]
        shifts.setdefault(mode, {})[severity] = np.array(measured)
        progress((done + 1) / len(jobs))
    return shifts


def _over_the_end(residual: Array) -> Array:
    mean: Array = residual[-round(SIGNS_WINDOW_S / DT_S) :].mean(axis=0)
    return mean


def _after_a_minute(residual: Array) -> Array:
    """The second minute after onset: later the dead engine has gone cold."""
    start = round((SIGNS_ONSET_S + 60.0) / DT_S)
    mean: Array = residual[start : start + round(SIGNS_WINDOW_S / DT_S)].mean(axis=0)
    return mean


def _at_the_worst(residual: Array) -> Array:
    """Of each channel the most extreme mean over 10 s: a fault that recovers has no last state."""
    width, stride, onset = round(10.0 / DT_S), round(2.0 / DT_S), round(SIGNS_ONSET_S / DT_S)
    starts = range(onset, len(residual) - width + 1, stride)
    moving = np.array([residual[start : start + width].mean(axis=0) for start in starts])
    extreme: Array = moving[np.abs(moving).argmax(axis=0), np.arange(residual.shape[1])]
    return extreme


_WINDOWS: Mapping[WindowKind, tuple[Callable[[Array], Array], str]] = {
    "last minute": (_over_the_end, f"mean over the last {SIGNS_WINDOW_S:g} s"),
    "second minute": (_after_a_minute, f"mean from 60 to {60 + SIGNS_WINDOW_S:g} s after onset"),
    "worst": (_at_the_worst, "most extreme mean over 10 s"),
}
"""How a shift is read from a residual, and that in words."""


def shift(mode: str, residual: Array) -> Array:
    """The shift of each channel (23,) that a flight's residual (n, 23) shows, in its unit."""
    read, _ = _WINDOWS[signatures().windows.get(mode, "last minute")]
    return read(residual)


def judge(reference: Signatures, shifts: Mapping[str, Mapping[float, Array]]) -> list[Row]:
    """A row for each mode flown and each channel of the reference, in their order."""
    return [
        _row(mode, name, expected, reference.disputed.get((mode, name)), shifts[mode])
        for mode, entries in reference.expected.items()
        if mode in shifts
        for name, expected in entries.items()
    ]


def _row(
    mode: str,
    name: str,
    expected: Expected,
    dispute: Dispute | None,
    shifts: Mapping[float, Array],
) -> Row:
    index, resolution = CHANNEL_INDEX[name], channel(name).sigma
    means = {severity: float(plans[:, index].mean()) for severity, plans in shifts.items()}
    clear = shifts[CLEAR][:, index]
    delta = means[CLEAR]

    def inside(low: float, high: float, values: Iterable[float]) -> bool:
        return all(low - resolution <= value <= high + resolution for value in values)

    held = {
        "+": delta > resolution,
        "-": delta < -resolution,
        "0": inside(expected.low, expected.high, [delta]),
        "~": None,
    }[expected.sign]
    return Row(
        fault=mode,
        channel=name,
        unit=channel(name).unit,
        expected=expected.sign,
        low=expected.low,
        high=expected.high,
        resolution=round(resolution, 4),
        delta=round(delta, 4),
        plans_low=round(float(clear.min()), 4),
        plans_high=round(float(clear.max()), 4),
        held=held,
        within=inside(expected.low, expected.high, means.values()),
        disputed=dispute.reason if dispute else None,
        stands=inside(dispute.low, dispute.high, means.values()) if dispute else None,
        deltas_by_severity={f"{severity:g}": round(mean, 4) for severity, mean in means.items()},
    )


def _settings(plans: list[Plan], quick: bool, reference: Signatures) -> dict[str, Any]:
    return {
        "quick": quick,
        "conditions": plans[0].conditions,
        "power": plans[0].power,
        "seeds": [plan.seed for plan in plans],
        "plans": [plan.to_dict() for plan in plans],
        "severities": list(SIGNS_SEVERITIES),
        "signs_judged_at_severity": CLEAR,
        "onset_s": SIGNS_ONSET_S,
        "cylinder": "the mode's usual one",
        "window": {
            "default": _WINDOWS["last minute"][1],
            **{mode: _WINDOWS[kind][1] for mode, kind in reference.windows.items()},
        },
        "resolution": {name: round(channel(name).sigma, 4) for name in reference.channels},
    }


def _complaints(counted: Iterable[Row]) -> list[str]:
    """A line for each entry that does not hold."""
    return [
        f"{row.fault} {row.channel}: expected {row.expected} in {row.low:g} to {row.high:g} "
        f"{row.unit}, got {', '.join(f'{value:.2f}' for value in row.deltas_by_severity.values())}"
        + (" (disputed)" if row.disputed else "")
        for row in counted
        if not (row.held and row.within)
    ]
