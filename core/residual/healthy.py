"""What the residual of a healthy field flight does by itself: how far it strays, and how slowly.

In field no mirror is this aircraft in this air, so the residual is never zero. Whether a channel
has left its mirror can only be said against what healthy flights do over the same time. Their
residuals are described channel by channel as a stationary Gaussian process: white noise and
Ornstein-Uhlenbeck processes of fixed time constants, whose variances are fitted to the variogram
of healthy field flights (`fitted`) at several levels of turbulence. Fitting to differences over
time leaves the constant offset of an aircraft open, which is therefore always estimated from the
flight itself.

CHT and EGT are rotated into what the four cylinders have in common and three contrasts between
them: air and throttle move the first, most faults move the others, which are far quieter.
"""

import json
import math
import re
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any, Literal, Self

import numpy as np
from scipy.optimize import nnls

from core.arrays import Array, Array32
from core.channels import (
    CHANNEL_INDEX,
    CHANNELS,
    N_CHANNELS,
    cht_name,
    egt_name,
)
from core.clock import DT_S
from core.cylinders import CYLINDERS
from core.errors import MirrorTwinError
from core.paths import MODELS

NAME = "field-healthy"
FORMAT = 1

STEP_S = 5.0
"""Everything here works on means over this time: gusts and sensor noise are shorter."""

STEP_SAMPLES = round(STEP_S / DT_S)

TAUS_S = (3.0, 10.0, 30.0, 100.0, 300.0, 1000.0)
"""Time constants of the Ornstein-Uhlenbeck processes, from a gust to the heat of the oil."""

FITTED_LAGS = 150
"""Differences over up to 750 s are fitted: longer ones than flights of 1,200 s show well."""

FLOOR_TAU = TAUS_S.index(300.0)
FLOOR_SHARE = 0.25
"""Every channel strays slowly by this share of its sensor's standard deviation at least.

The cylinders of two simulated aircraft differ by hundredths of a degree, more evenly than any
sensor is mounted.
"""

_MIX = np.array([[1, 1, 1, 1], [1, 1, -1, -1], [1, -1, 1, -1], [1, -1, -1, 1]]) / 4.0
_BY_CYLINDER = tuple(
    [CHANNEL_INDEX[name(cylinder)] for cylinder in CYLINDERS] for name in (cht_name, egt_name)
)
_NORMAL_ACCELERATION = CHANNEL_INDEX["NormAc"]

STEADY_RANGES: tuple[tuple[str, float], ...] = (
    ("E1 RPM", 40.0), ("E1 EGT1", 25.0), ("AltMSL", 200.0),
)  # fmt: skip
"""A mirror that stays within these ranges, in channel units, cruises; any other manoeuvres. The
mirror flies in still air: whatever moves it was commanded."""

Kind = Literal["cruise", "manoeuvres"]
KINDS: tuple[Kind, ...] = ("cruise", "manoeuvres")
_MAD_TO_SD = 1.4826


SENSOR_SD = np.array([channel.sigma for channel in CHANNELS])


def rotated(values: Array | Array32) -> Array:
    """(n, 23) with the four CHT, and the four EGT, as their mean and three contrasts."""
    mixed = np.array(values, dtype=np.float64)
    for columns in _BY_CYLINDER:
        mixed[:, columns] = values[:, columns] @ _MIX.T
    return mixed


def steps(residual: Array32) -> Array:
    """Means over `STEP_S`, (n, 23) -> (n // 250, 23); what is left over is left out."""
    n = len(residual) // STEP_SAMPLES
    whole = residual[: n * STEP_SAMPLES].reshape(n, STEP_SAMPLES, residual.shape[1])
    means: Array = whole.mean(axis=1, dtype=np.float64)
    return means


def gustiness(residual_steps: Array) -> float:
    """How rough the air is: the robust standard deviation of normal acceleration over steps, g."""
    values = residual_steps[:, _NORMAL_ACCELERATION]
    return float(_MAD_TO_SD * np.median(np.abs(values - np.median(values))))


def flown_kind(mirror_steps: Array) -> Kind:
    """Whether a flight has been a steady cruise, by step means (n, 23) of its mirror.

    The least and the most of each channel, (2, 23), tell as much.
    """
    for name, width in STEADY_RANGES:
        values = mirror_steps[:, CHANNEL_INDEX[name]]
        if float(np.ptp(values)) > width:
            return "manoeuvres"
    return "cruise"


def _step_covariance(tau_s: float, n: int) -> Array:
    """Autocovariance (n,) of step means of a process of unit variance and that time constant."""
    step = STEP_S / tau_s
    lags = np.arange(n)
    share = (1.0 - np.exp(-step)) / step
    covariance: Array = np.exp(-(np.maximum(lags, 1) - 1) * step) * share**2
    covariance[0] = 2.0 / step**2 * (step - 1.0 + np.exp(-step))
    return covariance


def _variogram(values: Array) -> Array:
    """Half the mean squared difference over 1 to `FITTED_LAGS` steps, (n, k) -> (lags, k)."""
    return np.array(
        [
            0.5 * np.square(values[lag:] - values[:-lag]).mean(axis=0)
            for lag in range(1, FITTED_LAGS + 1)
        ]
    )


def _variances(variogram: Array) -> Array:
    """White and Ornstein-Uhlenbeck variances, (1 + taus,), of one channel's variogram (lags,)."""
    columns = [np.ones(FITTED_LAGS)]
    for tau_s in TAUS_S:
        covariance = _step_covariance(tau_s, FITTED_LAGS + 1)
        columns.append(covariance[0] - covariance[1:])
    weight = 1.0 / np.maximum(variogram, 1e-12)
    found, _ = nnls(np.stack(columns, axis=1) * weight[:, None], variogram * weight)
    variances: Array = found
    return variances


@dataclass(frozen=True, slots=True, eq=False)
class HealthyResidual:
    """Healthy field residuals by kind of flight and level of turbulence.

    ``gustiness``: (kinds, levels) ascending, of `gustiness`. ``variances``: (kinds, levels, 23,
    1 + taus) of the white noise of step means and of each Ornstein-Uhlenbeck process, `rotated`
    channels. ``origin``: seeds, flights and code that it was made from.
    """

    gustiness: Array
    variances: Array
    origin: dict[str, Any]

    @classmethod
    def fitted(
        cls,
        flights: Iterable[tuple[Kind, float, Array]],
        origin: dict[str, Any] | None = None,
    ) -> Self:
        """From (kind, turbulence level, residual as `steps` (n, 23)) of healthy flights.

        Every kind needs flights at the same levels.
        """
        groups: dict[tuple[int, float], list[tuple[float, Array]]] = {}
        for kind, level, means in flights:
            group = groups.setdefault((KINDS.index(kind), level), [])
            group.append((math.log(gustiness(means)), _variogram(rotated(means))))
        levels = sorted({level for _, level in groups})
        roughness = np.full((len(KINDS), len(levels)), np.nan)
        variances = np.full((*roughness.shape, N_CHANNELS, 1 + len(TAUS_S)), np.nan)
        for (kind_row, level), group in groups.items():
            row = kind_row, levels.index(level)
            roughness[row] = math.exp(np.mean([log_roughness for log_roughness, _ in group]))
            mean = np.mean([variogram for _, variogram in group], axis=0)
            variances[row] = [_variances(mean[:, column]) for column in range(N_CHANNELS)]
        return cls(roughness, variances, origin or {})

    def process(self, kind: Kind, roughness: float) -> Array:
        """Variances (23, 1 + taus) in air of that `gustiness`, between the levels measured."""
        row = KINDS.index(kind)
        levels, variances = np.log(self.gustiness[row]), self.variances[row]
        at = float(np.clip(math.log(max(roughness, 1e-9)), levels[0], levels[-1]))
        upper = int(np.clip(np.searchsorted(levels, at), 1, len(levels) - 1))
        share = (at - levels[upper - 1]) / (levels[upper] - levels[upper - 1])
        found: Array = (1.0 - share) * variances[upper - 1] + share * variances[upper]
        found[:, 1 + FLOOR_TAU] += (FLOOR_SHARE * SENSOR_SD) ** 2
        return found

    def to_dict(self) -> dict[str, Any]:
        """Plain JSON-ready values."""
        return {
            "format": FORMAT,
            "name": NAME,
            "origin": self.origin,
            "step_s": STEP_S,
            "taus_s": list(TAUS_S),
            "kinds": list(KINDS),
            "channels": [channel.name for channel in CHANNELS],
            "gustiness": self.gustiness.tolist(),
            "variances": [
                [[[float(f"{value:.6g}") for value in row] for row in level] for level in kind]
                for kind in self.variances.tolist()
            ],
        }

    @classmethod
    def from_dict(cls, values: dict[str, Any]) -> Self:
        """Read what `to_dict` wrote; raises `ValueError` for another form."""
        written = values["format"], values["step_s"], values["taus_s"], values["kinds"]
        if written != (FORMAT, STEP_S, list(TAUS_S), list(KINDS)):
            raise ValueError("it is of another version")
        variances = np.asarray(values["variances"], dtype=np.float64)
        roughness = np.asarray(values["gustiness"], dtype=np.float64)
        if variances.shape != (*roughness.shape, N_CHANNELS, 1 + len(TAUS_S)):
            raise ValueError("it has other channels")
        return cls(roughness, variances, values["origin"])


def covariance(variances: Array, n: int) -> Array:
    """Autocovariance (n,) of the step means of a process with these variances (1 + taus,)."""
    total = np.zeros(n)
    total[0] = variances[0]
    for variance, tau_s in zip(variances[1:], TAUS_S, strict=True):
        total += variance * _step_covariance(tau_s, n)
    return total


def change_sd(process: Array, mean_steps: int, n: int) -> Array:
    """How far healthy channels stray from an earlier mean: standard deviations (n, 23).

    Both means are over ``mean_steps``; row k is that of the one which ends k + 1 steps after the
    earlier one has. ``process``: (23, 1 + taus) as `HealthyResidual.process` gives it. Channels are
    the logged ones, not `rotated`.
    """
    triangle = np.convolve(np.ones(mean_steps), np.ones(mean_steps)) / mean_steps**2
    reach = mean_steps - 1
    spread = np.full((n, N_CHANNELS), np.nan)
    for column, variances in enumerate(process):
        lagged = covariance(variances, n + mean_steps + 1)
        both_ways = np.concatenate([lagged[:0:-1], lagged])  # from -(n + mean_steps) on
        averaged = np.convolve(both_ways, triangle, mode="valid")
        zero = len(lagged) - 1 - reach
        spread[:, column] = 2.0 * (averaged[zero] - averaged[zero + 1 : zero + 1 + n])
    for columns in _BY_CYLINDER:  # a reading is the sum of what is common and its contrasts
        spread[:, columns] = spread[:, columns].sum(axis=1, keepdims=True)
    sd: Array = np.sqrt(np.maximum(spread, 0.0))
    return sd


def readable(healthy: HealthyResidual) -> str:
    """The file's text: JSON with one channel's numbers on a line."""
    text = json.dumps(healthy.to_dict(), indent=1)
    numbers = re.compile(r"\[\n[^\[\]{}\"]*\n *\]")
    return numbers.sub(lambda match: re.sub(r"\n *", " ", match[0]), text) + "\n"


@cache
def load_healthy(models: Path = MODELS) -> HealthyResidual:
    """The shipped description, read once a process.

    Raises `MirrorTwinError` if it is missing or of another version.
    """
    path = models / f"{NAME}.json"
    try:
        return HealthyResidual.from_dict(json.loads(path.read_text(encoding="utf-8")))
    except FileNotFoundError:
        raise MirrorTwinError(
            f"{path} is missing; make it with `mirrortwin train --healthy`"
        ) from None
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise MirrorTwinError(f"{path} cannot be read: {error}") from None
