"""The channels of both flights and their residuals, as ``fly/tiles.js`` draws them.

The tiles are uPlot canvases, not Plotly figures: one update of all costs Plotly 0.4 s of CPU,
which would hold up a flight that itself takes a second.
"""

from dataclasses import asdict
from typing import Any

import numpy as np
from numpy.typing import NDArray

from app.figures.axes import Array, Array32, base64_floats, kept_rows
from app.figures.engine_view import gauge_spec
from core.channels import CHANNELS, Channel, unit_label
from core.units import OTHER_UNITS

TILE_POINTS = 400
"""About two a pixel of a tile, so that every spike is kept where it is; 0.5 MB for all tiles."""


def tile_specs() -> list[dict[str, Any]]:
    """How to draw each channel, in channel order; ``other`` is the other unit it can be shown in.

    ``quiet`` and ``still`` are the least half-spans of the sensor and the residual axis, in the
    channel's unit: a channel in which nothing happens must look as if nothing happened.
    """
    return [_spec(channel) for channel in CHANNELS]


def cleared(
    key: str, duration_s: float, onset_s: float | None, run_id: str | None = None
) -> dict[str, Any]:
    """Empty tiles for a flight with this key and length; ``onset_s`` None marks no onset.

    ``run_id`` is the run whose marks belong to it.
    """
    return {"key": key, "run": run_id, "duration_s": duration_s, "onset_s": onset_s}


def decimated(time_s: Array, faulted: Array32, mirror: Array32) -> list[list[str]]:
    """A flight and its mirror, (n,) and (n, n_channels): of each channel time, faulted and mirror.

    At most 3 x `TILE_POINTS` samples, those that any of the three lines needs.
    """
    return [
        packed_lines(time_s, faulted[:, index], mirror[:, index]) for index in range(len(CHANNELS))
    ]


def _spec(channel: Channel) -> dict[str, Any]:
    noise = 4.0 * channel.sigma
    return {
        "name": channel.name,
        "label": channel.label,
        "unit": unit_label(channel.unit),
        "decimals": channel.decimals,
        "resting": sum(channel.green) / 2 if channel.green else 0.0,
        "quiet": max(noise, 0.02 * channel.full_scale),
        "still": max(noise, 0.01 * channel.full_scale),
        "limits": [limit for limit in channel.red if limit is not None],
        "gauge": gauge_spec(channel),
        "other": _other_unit(channel),
    }


def _other_unit(channel: Channel) -> dict[str, Any] | None:
    """A conversion as `core.units` has it, with the digits to add."""
    other = OTHER_UNITS.get(channel.unit)
    return None if other is None else asdict(other) | {"extra_decimals": other.extra_decimals}


def packed_lines(time_s: Array, faulted: Array32, mirror: Array32) -> list[str]:
    """One channel, (n,) each, at the samples that any of its three lines needs."""
    rows: NDArray[np.intp] = np.unique(
        np.concatenate(
            [kept_rows(time_s, line, TILE_POINTS) for line in (faulted, mirror, faulted - mirror)]
        )
    )
    return [base64_floats(values[rows]) for values in (time_s, faulted, mirror)]
