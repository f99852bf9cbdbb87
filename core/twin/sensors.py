"""The channels from states, effects and noise. This module never learns which fault flies.

Semi-empirical equations in quasi-steady plus first-order-lag form, vectorised over a block of
samples; the lags carry their state from block to block, so the result does not depend on how a
flight is cut. Constants and their sources stand in ``core.twin.constants``.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from scipy.signal import lfilter

from core.arrays import Array
from core.channels import CHANNEL_INDEX, N_CHANNELS, check_covers, cht_name, egt_name
from core.clock import DT_S
from core.cylinders import CYLINDERS
from core.fmea.effects import Effects
from core.twin.conditions import Airframe, Setting
from core.twin.constants import CRUISE_AIR_FUEL_RATIO, OIL_PSI, OIL_PSI_AT_DEGF, OIL_PSI_RPM, C
from core.twin.trajectory import STATE_INDEX


class Lag:
    """First-order lag y' = (u - y) / tau of columns, exact for inputs held over a step."""

    def __init__(self, tau_s: float) -> None:
        """At rest; the first input sets the state, as after a long steady flight."""
        self._keep = float(np.exp(-DT_S / tau_s))
        self._state: Array | None = None

    def __call__(self, inputs: Array) -> Array:
        """Filter the next samples, (n, k) -> (n, k)."""
        if self._state is None:
            self._state = self._keep * inputs[:1]
        outputs, self._state = lfilter(
            [1.0 - self._keep], [1.0, -self._keep], inputs, axis=0, zi=self._state
        )
        filtered: Array = outputs
        return filtered


class SensorSynthesiser:
    """The sensors of one flight, fed with consecutive blocks of it."""

    def __init__(self, setting: Setting) -> None:
        """The sensors of the setting's airframe, in thermal equilibrium."""
        compression = setting.time_compression
        self._airframe = setting.airframe
        self._head_lag = Lag(C.head_tau_s / compression)
        self._oil_lag = Lag(C.oil_tau_s / compression)
        self._egt_lag = Lag(C.egt_tau_s / compression)
        self._samples = 0

    def read(self, states: Array, effects: Effects, noise: Array) -> Array:
        """Channels (n, 23) of states (n, states), effects over n samples and noise (n, 23)."""
        rpm, charge = _column(states, "rpm"), _charge(states)
        metered = 1.0 - CRUISE_AIR_FUEL_RATIO / _column(states, "air_fuel_ratio")
        lean = effects.lean + metered[:, None]
        air_degf = _column(states, "oat_degc") * 1.8 + 32.0
        oil_target = _oil_target(states, effects, charge, air_degf, self._airframe.oil_heat)
        oil_degf = self._oil_lag(oil_target[:, None])[:, 0]
        cht = self._head_lag(self._head_target(states, effects, lean, charge, air_degf, oil_degf))
        egt = self._egt_lag(self._exhaust_target(effects, lean, charge))
        self._samples += len(states)

        now = _Readings(
            states,
            self._airframe,
            heads_degf=cht,
            exhausts_degf=egt,
            oil_degf=oil_degf,
            oil_psi=_oil_pressure(rpm, oil_degf, effects) + self._airframe.oil_offset_psi,
            alternator=np.minimum(rpm / C.alternator_rpm, 1.0),
        )
        out = np.full((len(states), N_CHANNELS), np.nan)
        for name, equation in EQUATIONS.items():
            out[:, CHANNEL_INDEX[name]] = equation(now)
        out += noise
        return out

    def _head_target(
        self,
        states: Array,
        effects: Effects,
        lean: Array,
        charge: Array,
        air_degf: Array,
        oil_degf: Array,
    ) -> Array:
        """Quasi-steady head temperatures, (n, 4): Th = (Ta + r Tg) / (1 + r)."""
        airflow = _column(states, "qbar_psf") / C.qbar_reference_psf
        heat = charge**C.charge_exponent / np.maximum(airflow, 0.05) ** C.airspeed_exponent
        burnt = np.maximum(
            effects.firing * (1.0 - effects.exhaust_leak - effects.charge_loss), C.windmilling
        )
        ratio = (
            C.head_ratio
            * self._airframe.head_heat
            * heat[:, None]
            * burnt**C.work_exponent
            * (1.0 + effects.gas_jet)
            / effects.cooling_efficiency
        )
        gas = C.gas_degf + C.gas_degf_per_lean * lean
        head = (air_degf[:, None] + ratio * gas) / (1.0 + ratio)
        oil = C.head_per_oil * (oil_degf - C.air_reference_degf - C.oil_degf_above_air)
        target: Array = head + oil[:, None] + self._airframe.cht_offset_degf
        return target

    def _exhaust_target(self, effects: Effects, lean: Array, charge: Array) -> Array:
        """Quasi-steady exhaust gas temperatures, (n, 4)."""
        time_s = (self._samples + np.arange(len(charge))) * DT_S
        beat = 1.0 + C.egt_valve_beat * np.sin(2.0 * np.pi * time_s / C.egt_valve_beat_s)
        burning = (
            C.egt_degf
            + C.egt_per_log_charge_degf * np.log(np.maximum(charge, 0.05))[:, None]
            + C.egt_per_lean_degf * lean
            - C.egt_lean_curvature_degf * np.abs(lean) * lean
            + C.egt_per_exhaust_leak_degf * effects.exhaust_leak * beat[:, None]
            + C.egt_per_charge_loss_degf * effects.charge_loss
            + self._airframe.egt_offset_degf
        )
        target: Array = effects.firing * burning + (1.0 - effects.firing) * C.egt_unburnt_degf
        return target


@dataclass(frozen=True, slots=True, eq=False)
class _Readings:
    """What the equations of the channels are written in, over a block of n samples.

    Temperatures by cylinder are (n, cylinders), all else (n,). ``alternator``: the share of its
    full voltage that the alternator gives.
    """

    states: Array
    airframe: Airframe
    heads_degf: Array
    exhausts_degf: Array
    oil_degf: Array
    oil_psi: Array
    alternator: Array

    def state(self, name: str) -> Array:
        """One state by name, (n,)."""
        return _column(self.states, name)

    def bus(self, full_volt: float, offset_volt: float) -> Array:
        """The voltage of a bus, which falls to the battery's as the alternator slows."""
        volt: Array = 24.0 + (full_volt - 24.0) * self.alternator + offset_volt
        return volt


def _column(states: Array, name: str) -> Array:
    column: Array = states[:, STATE_INDEX[name]]
    return column


_Equation = Callable[[_Readings], Array | float]


def _head(index: int) -> _Equation:
    return lambda now: now.heads_degf[:, index]


def _exhaust(index: int) -> _Equation:
    return lambda now: now.exhausts_degf[:, index]


EQUATIONS: Mapping[str, _Equation] = {
    "volt1": lambda now: now.bus(C.bus_volt, now.airframe.bus_offset_volt[0]),
    "volt2": lambda now: now.bus(C.essential_volt, now.airframe.bus_offset_volt[1]),
    "amp1": lambda now: (
        C.battery_amp + now.airframe.battery_offset_amp[0] - 25.0 * (1.0 - now.alternator)
    ),
    "amp2": lambda now: C.standby_amp + now.airframe.battery_offset_amp[1],
    "FQtyL": lambda now: now.state("fuel_left_gal"),
    "FQtyR": lambda now: now.state("fuel_right_gal"),
    "E1 FFlow": lambda now: now.state("fuel_flow_gph"),
    "E1 OilT": lambda now: now.oil_degf,
    "E1 OilP": lambda now: now.oil_psi,
    "E1 RPM": lambda now: now.state("rpm"),
    **{cht_name(cylinder): _head(index) for index, cylinder in enumerate(CYLINDERS)},
    **{egt_name(cylinder): _exhaust(index) for index, cylinder in enumerate(CYLINDERS)},
    "OAT": lambda now: now.state("oat_degc"),
    "IAS": lambda now: now.state("ias_kt"),
    "VSpd": lambda now: now.state("vspd_fpm"),
    "NormAc": lambda now: now.state("norm_ac_g") - 1.0,
    "AltMSL": lambda now: now.state("altitude_ft"),
}
"""What each channel's sensor reads, noise apart."""

check_covers("the equations of core/twin/sensors.py", EQUATIONS)


def _charge(states: Array) -> Array:
    """Air charge flow relative to the reference cruise."""
    flow: Array = _column(states, "rpm") * _column(states, "map_inhg") / 1000.0
    return flow / C.charge_reference


def _oil_target(
    states: Array, effects: Effects, charge: Array, air_degf: Array, oil_heat: float
) -> Array:
    """Quasi-steady oil temperature, (n,): T = Ta + heat / (sump + cooler * vernatherm(T))."""
    volume = np.maximum(1.0 - effects.oil_lost_qt / C.oil_quantity_qt, 0.05)
    blowby = (effects.exhaust_leak + effects.charge_loss).sum(axis=1)
    # An unburnt charge still compresses and rubs: most of its share of the oil heat remains.
    burnt = charge * effects.firing.mean(axis=1) ** C.oil_per_firing
    heat = np.maximum(burnt, C.oil_least_charge) ** C.oil_charge_exponent * (
        1.0 + C.oil_per_friction * effects.friction + C.oil_per_blowby * blowby
    )
    airflow = (
        np.maximum(_column(states, "qbar_psf") / C.qbar_reference_psf, 0.05)
        ** C.oil_airspeed_exponent
    )
    sump = (1.0 - C.oil_cooler_share) * volume**C.oil_sump_exponent
    cooler = C.oil_cooler_share * effects.cooler_efficiency / _vernatherm(_OIL_REFERENCE_DEGF)
    rise = oil_heat * C.oil_degf_above_air * heat / airflow
    # The vernatherm makes the balance implicit; it contracts, so a few damped steps solve it.
    oil_degf = air_degf + rise
    for _ in range(6):
        balance = air_degf + rise / (sump + cooler * _vernatherm(oil_degf))
        oil_degf = oil_degf + 0.55 * (balance - oil_degf)
    target: Array = oil_degf
    return target


_OIL_REFERENCE_DEGF = np.array(C.air_reference_degf + C.oil_degf_above_air)


def _vernatherm(oil_degf: Array) -> Array:
    """Share of the oil that goes through the cooler: opens smoothly as the oil warms."""
    span = C.vernatherm_open_degf - C.vernatherm_opens_degf
    x = np.clip((oil_degf - C.vernatherm_opens_degf) / span, 0.0, 1.0)
    share: Array = C.vernatherm_least + (1.0 - C.vernatherm_least) * x * x * (3.0 - 2.0 * x)
    return share


def _oil_pressure(rpm: Array, oil_degf: Array, effects: Effects) -> Array:
    """Oil pressure from pump speed, viscosity (temperature) and what is left to pump."""
    warm = np.minimum(oil_degf, C.oil_hot_degf) - OIL_PSI_AT_DEGF
    hot = np.maximum(oil_degf - C.oil_hot_degf, 0.0)
    pump = np.interp(rpm, OIL_PSI_RPM, OIL_PSI)
    feed = np.minimum(rpm / 2000.0, 1.0)
    pressure: Array = (
        pump
        + feed * (C.oil_psi_per_degf * warm + C.oil_psi_per_degf_hot * hot)
        + feed * C.oil_psi_per_qt * effects.oil_lost_qt
    )
    return np.maximum(pressure, 0.0)
