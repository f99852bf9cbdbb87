"""The marked moments of a flight, which ``fly/cursor.js`` draws and lists.

The onset is not among them: the page knows it with the first sample.
"""

from collections.abc import Sequence
from typing import Any, TypedDict

import numpy as np

from app.figures.axes import Array
from app.figures.probabilities import LEADERS
from core.channels import CHANNEL_INDEX, channel, unit_label
from core.diagnosis.diagnosis import Diagnosis
from core.diagnosis.naming import named_at
from core.fmea.fault import Fault
from core.twin.events import FlightEvent

MOST_EXCESSES = 200
"""Most excesses drawn, the longest first: a reading may cross its limit with every gust."""

LEAST_SHARE = 0.0005
"""Smaller shares are not shown."""

EVENT_LABELS = {"stall": "Stall", "lost_control": "Control lost", "ground": "Meets the ground"}


class Mark(TypedDict):
    """``kind``: evidence, named, action or limit, which has a channel and the end of its excess."""

    kind: str
    time_s: float
    end_s: float
    label: str
    channel: str


def verdict_marks(diagnosis: Diagnosis, fault: Fault) -> list[Mark]:
    """The first evidence, and the first right answer."""
    marks = evidence_marks(diagnosis)
    time_s, over_time = diagnosis.time_s, diagnosis.probabilities_over_time
    return marks + named_marks(diagnosis.classes, time_s, over_time, fault)


def evidence_marks(diagnosis: Diagnosis) -> list[Mark]:
    """The first channel that left its mirror; nothing where none did."""
    if not diagnosis.evidence:
        return []
    first = min(diagnosis.evidence, key=lambda evidence: evidence.onset_s)
    label = f"First evidence: {channel(first.channel).label}"
    return [_mark("evidence", first.onset_s, label)]


def named_marks(
    classes: Sequence[str], time_s: Array, probabilities: Array, fault: Fault
) -> list[Mark]:
    """The time from which the injected fault leads to the end; nothing for a healthy flight.

    ``time_s`` (k,) and ``probabilities`` (k, n_classes) are those of the windows so far.
    """
    if fault.mode == "nominal" or fault.mode not in classes or not len(time_s):
        return []
    right = list(classes).index(fault.mode)
    named_s = named_at(np.asarray(time_s), probabilities, right, fault.onset_s)
    return [] if named_s is None else [_mark("named", named_s, "First right answer")]


def action_marks(lines: Sequence[tuple[float, str]]) -> list[Mark]:
    """The actions of a live flight: time and words of each."""
    return [_mark("action", time_s, words) for time_s, words in lines]


def limit_marks(events: Sequence[FlightEvent]) -> list[Mark]:
    """Every excess of a limit, and what else a pilot would report, in the order of time."""
    by_length = sorted(events, key=lambda event: event.start_s - event.end_s)
    longest = sorted(by_length, key=lambda event: event.kind != "ground")[:MOST_EXCESSES]
    return [
        _mark("limit", event.start_s, _excess(event), event.end_s, event.kind)
        for event in sorted(longest, key=lambda event: event.start_s)
    ]


def track(
    run_id: str, names: dict[str, str], time_s: Array, probabilities: Array, colours: dict[str, str]
) -> dict[str, Any]:
    """The answers of all windows, for the ranking at the time cursor (``fly/ranking.js``).

    ``time_s`` (k,), ``probabilities`` (k, n_classes) by the classes in ``names``; ``colours`` are
    those of the lines in the chart. Of each window only the leaders are sent: place of the class
    and share.
    """
    return {
        "run": run_id,
        "classes": [{"name": name, "colour": colours.get(mode)} for mode, name in names.items()],
        "time_s": [round(float(time), 2) for time in time_s],
        "leaders": _leaders(np.asarray(probabilities)),
    }


def _leaders(windows: Array) -> list[list[tuple[int, float]]]:
    order = np.argsort(-windows, axis=1, kind="stable")[:, :LEADERS]
    shares = np.take_along_axis(windows, order, axis=1)
    return [
        [
            (place, round(share, 4))
            for place, share in zip(*window, strict=True)
            if share >= LEAST_SHARE
        ]
        for window in zip(order.tolist(), shares.tolist(), strict=True)
    ]


def _excess(event: FlightEvent) -> str:
    if event.kind not in CHANNEL_INDEX:
        return EVENT_LABELS[event.kind]
    side = "above" if event.value > event.limit else "below"
    label = channel(event.kind).label
    return f"{label} {side} {event.limit:g} {unit_label(event.unit)}"


def _mark(
    kind: str, time_s: float, label: str, end_s: float | None = None, channel_name: str = ""
) -> Mark:
    end_s = time_s if end_s is None else end_s
    return {
        "kind": kind, "time_s": round(time_s, 2), "end_s": round(end_s, 2), "label": label,
        "channel": channel_name,
    }  # fmt: skip
