"""A flight as a log of the Garmin G1000, so that the usual viewers and analysers open it.

The layout is that of the logs that the real device writes: a line about the airframe, a line of
units, a line of padded names, then a row a second. What the twin has no notion of (radios,
navigation, autopilot) stays blank, as it does in real logs where there is nothing to say.
"""

from collections.abc import Mapping
from dataclasses import astuple
from datetime import UTC, datetime, timedelta
from typing import Literal, NamedTuple, get_args

import numpy as np
from numpy.typing import NDArray

from core.arrays import Array
from core.channels import CHANNEL_INDEX, CHANNEL_NAMES, CHANNELS, channel, check_covers
from core.errors import InputError
from core.store.records import RunRecord
from core.twin.trajectory import Trajectory

Side = Literal["faulted", "mirror"]
SIDES: tuple[Side, ...] = get_args(Side)
"""The two flights of a run."""

SIMULATED_MODE = "SIMULATED"
"""What the head says of the mode, so that no reader takes the flight for a real one."""

UNIT_PART = "MirrorTwin"

RATE_HZ = 1
"""What the real device writes (some of its seconds twice, which we do not copy)."""

RATES_HZ = (1, 2, 5, 10, 25, 50)

HOME_DEG = (37.6499, -97.4331)
"""Latitude and longitude of where flights begin: the twin's world is flat and lies nowhere, but a
viewer wants a map. This is Wichita, Kansas, where Cessna built the 172P."""

_M_PER_DEG = 1852.0 * 60.0
_FT_PER_M = 1.0 / 0.3048
_KT_PER_MPS = 3600.0 / 1852.0
_SLUG_FT3_PER_KG_M3 = 1.0 / 515.379
_R_AIR = 287.053
_BARO_INHG = 29.92


class _Column(NamedTuple):
    """A column: its name, unit and width in characters; ``decimals`` None for text."""

    name: str
    unit: str
    width: int
    decimals: int | None = None


def _logged(name: str) -> _Column:
    return _Column(name, *astuple(channel(name).g1000))


_COLUMNS: tuple[_Column, ...] = (
    _Column("Lcl Date", "#yyy-mm-dd", 10), _Column("Lcl Time", "hh:mm:ss", 8),
    _Column("UTCOfst", "hh:mm", 7), _Column("AtvWpt", "ident", 6),
    _Column("Latitude", "degrees", 12, 7), _Column("Longitude", "degrees", 12, 7),
    _Column("AltB", "ft Baro", 7, 1), _Column("BaroA", "inch", 5, 2),
    _logged("AltMSL"), _logged("OAT"),
    _logged("IAS"), _Column("GndSpd", "kt", 6, 2),
    _logged("VSpd"), _Column("Pitch", "deg", 6, 2), _Column("Roll", "deg", 6, 2),
    _Column("LatAc", "G", 6, 2), _logged("NormAc"),
    _Column("HDG", "deg", 5, 1), _Column("TRK", "deg", 5, 1),
    *(_logged(one.name) for one in CHANNELS if one.subsystem != "flight"),
    _Column("AltGPS", "ft wgs", 7, 1), _Column("TAS", "kt", 3, 0), _Column("HSIS", "enum", 4),
    _Column("CRS", "deg", 6, 1),
    _Column("NAV1", "MHz", 6, 2), _Column("NAV2", "MHz", 6, 2),
    _Column("COM1", "MHz", 7, 3), _Column("COM2", "MHz", 7, 3),
    _Column("HCDI", "fsd", 6, 2), _Column("VCDI", "fsd", 6, 2),
    _Column("WndSpd", "kt", 6, 1), _Column("WndDr", "deg", 5, 0),
    _Column("WptDst", "nm", 6, 1), _Column("WptBrg", "deg", 6, 1), _Column("MagVar", "deg", 6, 1),
    _Column("AfcsOn", "bool", 6), _Column("RollM", "enum", 5), _Column("PitchM", "enum", 6),
    _Column("RollC", "deg", 5, 1), _Column("PichC", "deg", 5, 1), _Column("VSpdG", "fpm", 5, 1),
    _Column("GPSfix", "enum", 6),
    _Column("HAL", "mt", 4), _Column("VAL", "mt", 5), _Column("HPLwas", "mt", 6),
    _Column("HPLfd", "mt", 5), _Column("VPLwas", "mt", 6),
)  # fmt: skip
"""All columns in the device's order."""

COLUMN_NAMES = tuple(column.name for column in _COLUMNS)

check_covers(
    "the columns of core/exchange/g1000_writer.py",
    (name for name in COLUMN_NAMES if name in CHANNEL_INDEX),
)


def log_name(record: RunRecord, side: Side) -> str:
    """The name of the file for one flight of a run."""
    return f"mirrortwin-{record.id}-{side}.csv"


def g1000_csv(record: RunRecord, flight: Trajectory, rate_hz: int = RATE_HZ, *, side: Side) -> str:
    """One flight of a run as the text of a G1000 log, its clock UTC, from when it was flown.

    ``side`` says which flight it is: each has a system id of its own, since viewers sort by it.
    More than a row a second is not what the device does; the times then have decimals, which not
    every viewer reads. Raises `InputError` for a rate that is not one of `RATES_HZ`.
    """
    if rate_hz not in RATES_HZ:
        allowed = ", ".join(map(str, RATES_HZ))
        raise InputError("rate", f"must be one of {allowed} rows a second, got {rate_hz!r:.20}")
    n = len(flight)
    sampled_hz = (n - 1) / (flight.time_s[-1] - flight.time_s[0]) if n > 1 else 1.0
    rows = np.arange(0, n, max(1, round(sampled_hz / rate_hz)))
    values = {name: flight.channel(name)[rows] for name in CHANNEL_NAMES}
    texts = _filled(
        values | _flown(record, flight, rows),
        _clock(record, flight.time_s[rows], rate_hz)
        | {"UTCOfst": "+00:00", "HSIS": "GPS", "AfcsOn": "1", "GPSfix": "3D"},
        len(rows),
    )
    lines = [
        _airframe(record, side),
        ", ".join(_shown(column, column.unit) for column in _COLUMNS),
        ", ".join(_shown(column, column.name) for column in _COLUMNS),
        *map(", ".join, zip(*texts, strict=True)),
    ]
    return "\r\n".join(lines) + "\r\n"


def _airframe(record: RunRecord, side: Side) -> str:
    facts = {
        "log_version": "1.00",
        "airframe_name": "Cessna 172P",
        "unit_software_part_number": UNIT_PART,
        "unit_software_version": record.code_version.split(" ")[0],
        "system_software_part_number": "JSBSim",
        "system_id": f"{record.id}-{side}",
    }
    named = ", ".join(f'{name}="{value}"' for name, value in facts.items())
    return f"#airframe_info, {named}, mode={SIMULATED_MODE}, "


def _clock(record: RunRecord, time_s: Array, rate_hz: int) -> dict[str, list[str]]:
    began = datetime.fromisoformat(record.created).astimezone(UTC).replace(microsecond=0)
    moments = [began + timedelta(seconds=round(float(time), 3)) for time in time_s]
    digits = len("hh:mm:ss") if rate_hz == 1 else len("hh:mm:ss.fff")
    return {
        "Lcl Date": [f"{moment:%Y-%m-%d}" for moment in moments],
        "Lcl Time": [f"{moment:%H:%M:%S.%f}"[:digits] for moment in moments],
    }


def _flown(record: RunRecord, flight: Trajectory, rows: NDArray[np.intp]) -> dict[str, Array]:
    """What a G1000 knows beside our channels: attitude, GPS, air data."""
    state = {name: flight.state(name)[rows] for name in ("north_m", "east_m", "altitude_ft")}
    seconds = flight.time_s[rows]
    north, east, climb = (_rate(seconds, values) for values in state.values())
    altitude_m = state["altitude_ft"] / _FT_PER_M
    # The standard atmosphere's pressure (ICAO Doc 7488), and the air's own temperature.
    pressure = 101_325.0 * (1.0 - 2.25577e-5 * altitude_m) ** 5.25588
    density = pressure / (_R_AIR * (273.15 + flight.state("oat_degc")[rows]))
    qbar = flight.state("qbar_psf")[rows]
    tas_mps = np.sqrt(2.0 * np.maximum(qbar, 0.0) / (density * _SLUG_FT3_PER_KG_M3)) / _FT_PER_M
    heading = np.radians(flight.state("heading_deg")[rows])
    # As the device does it: over the ground less through the air, with no slip.
    wind = np.stack([north - tas_mps * np.cos(heading), east - tas_mps * np.sin(heading)])
    latitude = HOME_DEG[0] + state["north_m"] / _M_PER_DEG
    parallel = np.cos(np.radians(HOME_DEG[0]))
    same = np.ones(len(rows))
    return {
        "Latitude": latitude,
        "Longitude": HOME_DEG[1] + state["east_m"] / (_M_PER_DEG * parallel),
        "AltB": flight.channel("AltMSL")[rows].astype(np.float64),
        "BaroA": _BARO_INHG * same,
        "GndSpd": np.hypot(north, east) * _KT_PER_MPS,
        "Pitch": flight.state("pitch_deg")[rows],
        "Roll": flight.state("roll_deg")[rows],
        "HDG": _compass(flight.state("heading_deg")[rows]),
        "TRK": _compass(np.degrees(np.arctan2(east, north))),
        "AltGPS": state["altitude_ft"],
        "TAS": tas_mps * _KT_PER_MPS,
        "CRS": record.plan.heading_deg * same,
        "WndSpd": np.hypot(*wind) * _KT_PER_MPS,
        "WndDr": np.degrees(np.arctan2(-wind[1], -wind[0])).round() % 360.0,
        "MagVar": 0.0 * same,
        "VSpdG": climb * 60.0,
    }


def _rate(time_s: Array, values: Array) -> Array:
    """The time derivative (n,) of values (n,); zero for a single row."""
    return np.gradient(values, time_s) if len(values) > 1 else np.zeros(len(values))


def _compass(degrees: Array) -> Array:
    """Directions as they are written, 0.0 to 359.9."""
    rounded: Array = np.round(degrees, 1) % 360.0
    return rounded


def _filled(
    numbers: Mapping[str, NDArray[np.floating]], words: Mapping[str, str | list[str]], n: int
) -> list[list[str]]:
    """Each column's cells; blank where nothing is known or a number is not finite."""
    texts = []
    for column in _COLUMNS:
        blank = [" " * column.width] * n
        if column.name in words:
            given = words[column.name]
            cells = [given] * n if isinstance(given, str) else given
            texts.append([_shown(column, cell) for cell in cells])
        elif column.name in numbers:
            form = f"{column.width}.{column.decimals}f"
            texts.append(
                [
                    format(value, form) if np.isfinite(value) else blank[0]
                    for value in numbers[column.name].tolist()
                ]
            )
        else:
            texts.append(blank)
    return texts


def _shown(column: _Column, text: str) -> str:
    return text.rjust(column.width)
