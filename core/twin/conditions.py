"""Lab and field: what a flight meets, and how much of it the mirror knows.

Lab is the paper's protocol: the mirror is the same aircraft in the same air with the same sensor
noise. Field is what a hangar has: an aircraft and a pilot like those of the real logs, of whom the
mirror, being a computation, knows the aircraft and the weather only roughly and the pilot's hand,
the gusts, the wander of the metering and the noise of the sensors not at all.
"""

from dataclasses import dataclass, replace

import numpy as np

from core.arrays import Array
from core.channels import N_CHANNELS
from core.cylinders import N_CYLINDERS
from core.twin.plan import Plan, Weather

TIME_COMPRESSION = {"lab": 4.0, "field": 1.0}
"""Heat lags are divided by this: the paper's 300 s runs need faster heads than real ones."""

FUEL_LB = {"lab": (85.0, 140.0), "field": (105.0, 145.0)}
"""What a tank holds at the start; real flights leave with their tanks nearly full."""

FIELD_HEAD_HEAT = 0.86
FIELD_OIL_HEAT = 0.82
"""Field aircraft run cooler than the lab's: 257-264 F (heads) and 97-102 F (oil) above the outside
air in the steady cruise of real logs (``assets/facts/real_noise.csv``)."""


@dataclass(frozen=True, slots=True)
class Airframe:
    """What differs between two aircraft of one type.

    ``cht_offset_degf`` and ``egt_offset_degf`` are by cylinder; ``bus_offset_volt`` and
    ``battery_offset_amp`` are (main, essential) and (battery, standby). ``head_heat`` and
    ``oil_heat`` are what heads and oil have to shed, relative to the lab's aircraft.
    ``noise_rank`` is (23,): how noisy each sensor is for one of its kind, a standard normal.
    """

    cht_offset_degf: Array
    egt_offset_degf: Array
    oil_offset_psi: float
    bus_offset_volt: tuple[float, float]
    battery_offset_amp: tuple[float, float]
    head_heat: float
    oil_heat: float
    noise_rank: Array


@dataclass(frozen=True, slots=True)
class Setting:
    """Everything around one flight of a pair, apart from the fault.

    ``noise_stream`` seeds the sensor noise, None for none; ``hand_stream`` what the pilot's hand
    and the metering do by themselves, None for nothing.
    """

    airframe: Airframe
    weather: Weather
    is_field: bool
    noise_stream: tuple[int, int] | None
    hand_stream: tuple[int, int] | None

    @property
    def conditions(self) -> str:
        """The key of what lab and field do differently."""
        return "field" if self.is_field else "lab"

    @property
    def time_compression(self) -> float:
        """By how much heat lags are shortened."""
        return TIME_COMPRESSION[self.conditions]


def _lab_airframe(seed: int) -> Airframe:
    """Manufacturing deviations as measured: CHT sd 4 F, EGT sd 15 F, No. 2 EGT highest."""
    rng = np.random.default_rng([seed, 0xA1F0])
    cht = np.clip(rng.normal(0.0, 4.0, N_CYLINDERS), -9.0, 9.0)
    egt = np.clip(rng.normal(0.0, 13.0, N_CYLINDERS), -28.0, 28.0)
    egt[1] = max(egt[1], float(egt.max())) + 6.0
    return Airframe(
        cht_offset_degf=cht - cht.mean(),
        egt_offset_degf=egt - egt.mean(),
        oil_offset_psi=0.0,
        bus_offset_volt=(0.0, 0.0),
        battery_offset_amp=(0.0, 0.0),
        head_heat=1.0,
        oil_heat=1.0,
        noise_rank=np.zeros(N_CHANNELS),
    )


def _field_airframe(seed: int) -> Airframe:
    """The lab deviations plus those of cooling, oil system, bus and gauges between aircraft."""
    rng = np.random.default_rng([seed, 0xA1F1])
    lab = _lab_airframe(seed)
    bus, essential = rng.normal(0.0, (0.02, 0.02))
    battery, standby = rng.normal(0.0, (0.06, 0.02))
    return Airframe(
        cht_offset_degf=lab.cht_offset_degf,
        egt_offset_degf=lab.egt_offset_degf + rng.normal(0.0, 12.0),
        oil_offset_psi=float(rng.normal(0.0, 0.5)),
        bus_offset_volt=(float(bus), float(bus + essential)),
        battery_offset_amp=(float(battery), float(standby)),
        head_heat=FIELD_HEAD_HEAT * float(np.exp(rng.normal(0.0, 0.025))),
        oil_heat=FIELD_OIL_HEAT * float(np.exp(rng.normal(0.0, 0.03))),
        noise_rank=rng.standard_normal(N_CHANNELS),
    )


def _roughly(airframe: Airframe, seed: int) -> Airframe:
    """The aircraft as its last flights showed it: CHT to 2 F, EGT to 5 F, oil to 1 F, 0.2 psi."""
    rng = np.random.default_rng([seed, 0xA1F2])
    return replace(
        airframe,
        cht_offset_degf=airframe.cht_offset_degf + rng.normal(0.0, 1.5, N_CYLINDERS),
        egt_offset_degf=airframe.egt_offset_degf + rng.normal(0.0, 5.0, N_CYLINDERS),
        oil_offset_psi=airframe.oil_offset_psi + float(rng.normal(0.0, 0.2)),
        head_heat=airframe.head_heat * float(np.exp(rng.normal(0.0, 0.005))),
        oil_heat=airframe.oil_heat * float(np.exp(rng.normal(0.0, 0.01))),
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
        hand_stream=(plan.seed, 0x3E7E) if is_field else None,
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
        hand_stream=None,
    )
