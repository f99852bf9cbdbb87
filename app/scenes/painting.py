"""The colouring of the faulted path: by a channel or its residual, on a scale with a legend.

Readings are drawn on Cividis (Nuñez et al. 2018), which looks alike to people with and without
red-green blindness and rises evenly in lightness; its palest end, lost on a light sky, is left out.
Residuals are drawn on the two-sided scale of the heat strips. Neither uses green, amber or red,
which mean status.
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from app import theme
from app.scenes.palette import rgb
from core.channels import CHANNEL_INDEX, CHANNELS, channel, unit_label
from core.clock import clock
from core.errors import InputError

Array = NDArray[np.float64]
Colours = NDArray[np.uint8]
Kind = Literal["reading", "residual"]

READING_STOPS = ("#00224e", "#123570", "#3b496c", "#575d6d", "#707173", "#8a8678", "#a59c74",
                 "#c3b369", "#e1cc55")  # fmt: skip
RESIDUAL_STOPS = (theme.DIVERGING[0][1], theme.DIVERGING[1][1], "#7f8995", theme.DIVERGING[3][1],
                  theme.DIVERGING[4][1])  # fmt: skip
_LEAST_SIGMA = 4.0


@dataclass(frozen=True, slots=True)
class Paint:
    """A quantity to colour the path by."""

    channel: str
    kind: Kind

    @staticmethod
    def read(text: str | None) -> "Paint | None":
        """``residual:E1 CHT1`` as the page sends it, empty for none; raises `InputError`."""
        if not text:
            return None
        kind, _, name = text.partition(":")
        if kind not in ("reading", "residual") or name not in CHANNEL_INDEX:
            raise InputError("colour", f"is no channel or residual: {text!r:.40}")
        return Paint(name, "reading" if kind == "reading" else "residual")

    @property
    def text(self) -> str:
        """What `read` reads."""
        return f"{self.kind}:{self.channel}"

    @property
    def stops(self) -> tuple[str, ...]:
        """The colours of its scale, lowest value first."""
        return READING_STOPS if self.kind == "reading" else RESIDUAL_STOPS

    def label(self, value: float) -> str:
        """A value with its unit; a residual with its sign."""
        logged = channel(self.channel)
        sign = "+" if self.kind == "residual" and value else ""
        return f"{value:{sign},.{logged.decimals}f} {unit_label(logged.unit)}".rstrip()


def choices() -> list[dict[str, object]]:
    """Everything that the path can be coloured by, for a select with groups."""
    groups: list[dict[str, object]] = []
    for kind, head in (("residual", "Residual, faulted less mirror"), ("reading", "Reading")):
        items = [{"value": f"{kind}:{item.name}", "label": f"{item.label}"
                  + (" residual" if kind == "residual" else "")} for item in CHANNELS]  # fmt: skip
        groups.append({"group": head, "items": items})
    return groups


@dataclass(frozen=True, slots=True, eq=False)
class Readings:
    """Readings of both aircraft. ``time_s``: (n,). ``faulted``, ``mirror``: (n, n_channels)."""

    time_s: Array
    faulted: NDArray[np.float32]
    mirror: NDArray[np.float32]

    def joined(self, later: "Readings") -> "Readings":
        """These and the ones that follow."""
        return Readings(
            np.concatenate([self.time_s, later.time_s]),
            np.concatenate([self.faulted, later.faulted]),
            np.concatenate([self.mirror, later.mirror]),
        )

    def values(self, paint: Paint) -> Array:
        """What is painted, (n,)."""
        column = CHANNEL_INDEX[paint.channel]
        values = self.faulted[:, column].astype(np.float64)
        return values - self.mirror[:, column] if paint.kind == "residual" else values


def scale_of(paint: Paint, readings: Readings) -> tuple[float, float]:
    """The ends of the scale: all that was read, and never so little that noise looks like much.

    Even around zero for residuals.
    """
    values = readings.values(paint)
    logged = channel(paint.channel)
    least = _LEAST_SIGMA * logged.sigma
    if paint.kind == "residual":
        reach = max(float(np.abs(values).max(initial=0.0)), least)
        return -reach, reach
    low, high = float(values.min(initial=np.inf)), float(values.max(initial=-np.inf))
    if not np.isfinite(low):
        return 0.0, least
    short = max(0.0, least - (high - low)) / 2.0
    return low - short, high + short


def colours_at(paint: Paint, readings: Readings, time_s: ArrayLike) -> Colours:
    """The path's colours (n, 3) at times (n,)."""
    low, high = scale_of(paint, readings)
    values = np.interp(np.asarray(time_s), readings.time_s, readings.values(paint))
    share = np.clip((values - low) / (high - low), 0.0, 1.0)
    stops = np.array([rgb(colour) for colour in paint.stops], dtype=np.float64)
    places = np.linspace(0.0, 1.0, len(stops))
    mixed = np.stack([np.interp(share, places, column) for column in stops.T], axis=1)
    return mixed.round().astype(np.uint8)


@dataclass(frozen=True, slots=True)
class Legend:
    """The key of a painted path: CSS colours and the values at the ends."""

    stops: tuple[str, ...]
    low: str
    high: str
    until: str


def legend_of(paint: Paint, readings: Readings) -> Legend:
    """The key, true for the flight so far."""
    low, high = scale_of(paint, readings)
    return Legend(paint.stops, paint.label(low), paint.label(high), clock(readings.time_s[-1]))
