"""Lab and field: what a flight meets, and how much of it the mirror knows.

Lab is the paper's protocol: the mirror is the same aircraft in the same air with the same sensor
noise. Field is what a hangar has: the mirror knows the aircraft and the weather only roughly, has
no gusts, no metering wander and, being a computation, no sensor noise to share or to add.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from core.twin.plan import Plan, Weather

Array = NDArray[np.float64]

TIME_COMPRESSION = {"lab": 4.0, "field": 1.0}
"""Heat lags are divided by this: the paper's 300 s runs need faster heads than real ones."""

MIXTURE_WANDER_SD = 0.004
MIXTURE_WANDER_TAU_S = 25.0
"""Field only: metering is never quite steady, and moves all EGT and the fuel flow together."""


@dataclass(frozen=True, slots=True)
class Airframe:
    """What differs between two aircraft of one type.

    ``cht_offset_degf`` and ``egt_offset_degf`` are (4,) by cylinder.
    """

    cht_offset_degf: Array
    egt_offset_degf: Array
    oil_offset_degf: float = 0.0
    oil_offset_psi: float = 0.0
    bus_offset_volt: float = 0.0


@dataclass(frozen=True, slots=True)
class Setting:
    """Everything around one flight of a pair, apart from the fault.

    ``noise_stream`` seeds the sensor noise, None for none; ``metering_stream`` the slow wander of
    the mixture, None for none.
    """

    airframe: Airframe
    weather: Weather
    is_field: bool
    noise_stream: tuple[int, int] | None
    metering_stream: tuple[int, int] | None

    @property
    def time_compression(self) -> float:
        """By how much heat lags are shortened."""
        return TIME_COMPRESSION["field" if self.is_field else "lab"]


def _lab_airframe(seed: int) -> Airframe:
    """Manufacturing deviations as measured: CHT sd 4 F, EGT sd 15 F, No. 2 EGT highest."""
    rng = np.random.default_rng([seed, 0xA1F0])
    cht = np.clip(rng.normal(0.0, 4.0, 4), -9.0, 9.0)
    egt = np.clip(rng.normal(0.0, 13.0, 4), -28.0, 28.0)
    egt[1] = max(egt[1], float(egt.max())) + 6.0
    return Airframe(cht - cht.mean(), egt - egt.mean())


def _field_airframe(seed: int) -> Airframe:
    """The lab deviations plus those of oil system and bus between real aircraft."""
    rng = np.random.default_rng([seed, 0xA1F1])
    lab = _lab_airframe(seed)
    return Airframe(
        lab.cht_offset_degf + rng.normal(0.0, 4.0),
        lab.egt_offset_degf + rng.normal(0.0, 12.0),
        oil_offset_degf=float(rng.normal(-2.0, 3.0)),
        oil_offset_psi=float(rng.normal(0.0, 0.7)),
        bus_offset_volt=float(rng.normal(0.0, 0.03)),
    )


def _roughly(airframe: Airframe, seed: int) -> Airframe:
    """The aircraft as its last flights showed it: CHT to 1.5 F, EGT to 5 F, oil to 1 F, 0.2 psi."""
    rng = np.random.default_rng([seed, 0xA1F2])
    return Airframe(
        airframe.cht_offset_degf + rng.normal(0.0, 1.5, 4),
        airframe.egt_offset_degf + rng.normal(0.0, 5.0, 4),
        airframe.oil_offset_degf + float(rng.normal(0.0, 1.0)),
        airframe.oil_offset_psi + float(rng.normal(0.0, 0.2)),
        airframe.bus_offset_volt + float(rng.normal(0.0, 0.005)),
    )


def _forecast(weather: Weather, seed: int) -> Weather:
    """The weather as the mirror has it: air to 1 degC, wind to 2 kt and 10 deg, no gusts."""
    rng = np.random.default_rng([seed, 0xA1F3])
    return Weather(
        isa_deviation_degc=float(
            np.clip(weather.isa_deviation_degc + rng.normal(0.0, 1.0), -20.0, 25.0)
        ),
        wind_kt=float(np.clip(weather.wind_kt + rng.normal(0.0, 2.0), 0.0, 40.0)),
        wind_from_deg=float((weather.wind_from_deg + rng.normal(0.0, 10.0)) % 360.0),
        turbulence=0.0,
    )


def flown(plan: Plan) -> Setting:
    """The setting of the aircraft that really flies."""
    is_field = plan.conditions == "field"
    return Setting(
        airframe=_field_airframe(plan.seed) if is_field else _lab_airframe(plan.seed),
        weather=plan.weather,
        is_field=is_field,
        noise_stream=(plan.seed, 0x0153),
        metering_stream=(plan.seed, 0x3E7E) if is_field else None,
    )


def mirrored(plan: Plan) -> Setting:
    """The setting of the mirror: the same in lab, roughly the same in field."""
    setting = flown(plan)
    if not setting.is_field:
        return setting
    return replace(
        setting,
        airframe=_roughly(setting.airframe, plan.seed),
        weather=_forecast(plan.weather, plan.seed),
        noise_stream=None,
        metering_stream=None,
    )
