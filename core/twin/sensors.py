"""The 23 channels from states, effects and noise. This module never learns which fault flies.

Semi-empirical equations in quasi-steady plus first-order-lag form, vectorised over a block of
samples; the lags carry their state from block to block, so the result does not depend on how a
flight is cut. Constants with their sources stand in `Constants`; [D] computed from real G1000 logs,
[K] engineering judgement (``../shared/facts/fmea.md``).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from core.channels import CHANNEL_INDEX, N_CHANNELS
from core.fmea.effects import Effects
from core.twin.plan import DT_S, Plan
from core.twin.trajectory import STATE_INDEX

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Constants:
    """Every constant of the sensor equations, in the unit of its name."""

    # Head heat balance (NACA form: (Th - Ta) / (Tg - Th) = r), reference 100 KIAS, 5000 ft, ISA.
    head_ratio: float = 0.335  # gives CHT near 315 F at the reference [D]
    charge_exponent: float = 0.50  # head heat against charge flow [K]
    airspeed_exponent: float = 0.17  # head cooling against dynamic pressure, slipstream aside [K]
    gas_degf: float = 1150.0  # effective gas temperature [K]
    gas_degf_per_lean: float = 340.0  # +1 F CHT per 1 % leaner [D]
    work_exponent: float = 0.50  # head heat against the cylinder's work [K]
    windmilling: float = (
        0.12  # heat of an engine turned by the propeller, share of a firing one [K]
    )
    head_per_oil: float = 0.10  # degF CHT per degF oil, piston and head oil cooling [K]
    head_tau_s: float = 172.0  # 150-200 s in 11 of 12 cylinder-logs [D]
    # Exhaust gas.
    egt_degf: float = 1365.0  # cruise mean, rich of peak [D]
    egt_per_log_charge_degf: float = 95.0  # taxi to cruise [D]
    egt_per_lean_degf: float = 1000.0  # +10 F per 1 % leaner [D]
    egt_lean_curvature_degf: float = 2800.0  # peak 18 % leaner than cruise [D, rounded]
    egt_per_exhaust_leak_degf: float = 280.0  # burnt valve, +100 F when severe
    egt_valve_beat: float = 0.12  # slow beat of a rotating burnt valve, share of its rise
    egt_valve_beat_s: float = 60.0  # about one cycle a minute
    egt_per_charge_loss_degf: float = -570.0  # gas that never reaches the probe [K]
    egt_unburnt_degf: float = 580.0  # probe in a cylinder that does not fire [K]
    egt_tau_s: float = 9.0  # probe and gas, 6-12 s [D]
    # Oil.
    oil_degf_above_air: float = 122.0  # sump above outside air at the reference [D]
    oil_cooler_share: float = 0.55  # share of oil heat that the cooler carries [K]
    oil_sump_exponent: float = 0.50  # sump heat rejection against oil quantity [K]
    oil_charge_exponent: float = 0.17  # oil heat against charge flow [K]
    oil_per_friction: float = 0.42  # relative oil heat per relative friction [K]
    oil_per_blowby: float = 0.10  # relative oil heat per share of one cylinder's charge lost [K]
    oil_per_firing: float = 0.25  # exponent of the firing share in the oil heat [K]
    oil_least_charge: float = 0.45  # oil heat of a windmilling engine, as a charge flow [K]
    oil_airspeed_exponent: float = 0.04  # cooler and sump against free-stream pressure [K]
    oil_tau_s: float = 320.0  # 120 to 600 s [D]
    oil_quantity_qt: float = 7.0
    oil_psi_per_degf: float = -0.115  # viscosity [D: -0.05 to -0.13]
    oil_psi_per_degf_hot: float = -0.30  # above oil_hot_degf [K]
    oil_hot_degf: float = 215.0
    oil_psi_per_qt: float = -2.6  # foaming and pump feed with lost volume (paper section 3.2)
    # Electrical.
    bus_volt: float = 28.07  # [D]
    essential_volt: float = 28.05  # [D]
    alternator_rpm: float = 650.0  # below this the alternator no longer holds the bus [K]
    battery_amp: float = 0.43  # float charge [D]
    standby_amp: float = 0.03  # [D]
    # Reference point.
    charge_reference: float = 35.4  # rpm times manifold inHg / 1000 at the reference
    qbar_reference_psf: float = 33.9
    air_reference_degf: float = 41.2


C = Constants()

TIME_COMPRESSION = {"lab": 4.0, "field": 1.0}
"""Heat lags are divided by this: the paper's 300 s runs need faster heads than real ones."""

_OIL_PSI_RPM = np.array([0.0, 300.0, 700.0, 900.0, 1150.0, 1500.0, 1850.0, 2150.0, 2400.0, 2550.0,
                         3000.0])  # fmt: skip
_OIL_PSI = np.array([0.0, 38.0, 53.0, 57.0, 60.0, 64.0, 67.5, 70.4, 72.2, 73.6, 77.4])
"""Oil pressure against engine speed at 150-165 F, three real logs [D]."""
_OIL_PSI_AT_DEGF = 162.0


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


@dataclass(frozen=True, slots=True)
class Airframe:
    """What differs between two aircraft of one type, (4,) each, in degF."""

    cht_offset_degf: Array
    egt_offset_degf: Array

    @classmethod
    def of_seed(cls, seed: int) -> "Airframe":
        """Manufacturing deviations as measured: CHT sd 4 F, EGT sd 15 F, No. 2 EGT highest."""
        rng = np.random.default_rng([seed, 0xA1F0])
        cht = np.clip(rng.normal(0.0, 4.0, 4), -9.0, 9.0)
        egt = np.clip(rng.normal(0.0, 13.0, 4), -28.0, 28.0)
        egt[1] = max(egt[1], float(egt.max())) + 6.0
        return cls(cht - cht.mean(), egt - egt.mean())


class SensorSynthesiser:
    """The sensors of one flight, fed with consecutive blocks of it."""

    def __init__(self, plan: Plan) -> None:
        """Sensors of the aircraft that ``plan.seed`` stands for, in thermal equilibrium."""
        compression = TIME_COMPRESSION[plan.conditions]
        self._airframe = Airframe.of_seed(plan.seed)
        self._head_lag = Lag(C.head_tau_s / compression)
        self._oil_lag = Lag(C.oil_tau_s / compression)
        self._egt_lag = Lag(C.egt_tau_s / compression)
        self._samples = 0

    def read(self, states: Array, effects: Effects, noise: Array) -> Array:
        """Channels (n, 23) of states (n, states), effects over n samples and noise (n, 23)."""
        rpm, charge = _column(states, "rpm"), _charge(states)
        air_degf = _column(states, "oat_degc") * 1.8 + 32.0
        oil_degf = self._oil_lag(_oil_target(states, effects, charge, air_degf)[:, None])[:, 0]
        cht = self._head_lag(self._head_target(states, effects, charge, air_degf, oil_degf))
        egt = self._egt_lag(self._exhaust_target(effects, charge))
        self._samples += len(states)

        out = np.empty((len(states), N_CHANNELS))
        first_cht, first_egt = CHANNEL_INDEX["E1 CHT1"], CHANNEL_INDEX["E1 EGT1"]
        out[:, first_cht : first_cht + 4] = cht
        out[:, first_egt : first_egt + 4] = egt
        alternator = np.minimum(rpm / C.alternator_rpm, 1.0)
        for name, values in (
            ("volt1", 24.0 + (C.bus_volt - 24.0) * alternator),
            ("volt2", 24.0 + (C.essential_volt - 24.0) * alternator),
            ("amp1", C.battery_amp - 25.0 * (1.0 - alternator)),
            ("amp2", np.full(len(states), C.standby_amp)),
            ("FQtyL", _column(states, "fuel_left_gal")),
            ("FQtyR", _column(states, "fuel_right_gal")),
            ("E1 FFlow", _column(states, "fuel_flow_gph")),
            ("E1 OilT", oil_degf),
            ("E1 OilP", _oil_pressure(rpm, oil_degf, effects)),
            ("E1 RPM", rpm),
            ("OAT", _column(states, "oat_degc")),
            ("IAS", _column(states, "ias_kt")),
            ("VSpd", _column(states, "vspd_fpm")),
            ("NormAc", _column(states, "norm_ac_g") - 1.0),
            ("AltMSL", _column(states, "altitude_ft")),
        ):
            out[:, CHANNEL_INDEX[name]] = values
        out += noise
        return out

    def _head_target(
        self, states: Array, effects: Effects, charge: Array, air_degf: Array, oil_degf: Array
    ) -> Array:
        """Quasi-steady head temperatures, (n, 4): Th = (Ta + r Tg) / (1 + r)."""
        airflow = _column(states, "qbar_psf") / C.qbar_reference_psf
        heat = charge**C.charge_exponent / np.maximum(airflow, 0.05) ** C.airspeed_exponent
        burnt = np.maximum(
            effects.firing * (1.0 - effects.exhaust_leak - effects.charge_loss), C.windmilling
        )
        ratio = (
            C.head_ratio
            * heat[:, None]
            * burnt**C.work_exponent
            * (1.0 + effects.gas_jet)
            / effects.cooling_efficiency
        )
        gas = C.gas_degf + C.gas_degf_per_lean * effects.lean
        head = (air_degf[:, None] + ratio * gas) / (1.0 + ratio)
        oil = C.head_per_oil * (oil_degf - C.air_reference_degf - C.oil_degf_above_air)
        target: Array = head + oil[:, None] + self._airframe.cht_offset_degf
        return target

    def _exhaust_target(self, effects: Effects, charge: Array) -> Array:
        """Quasi-steady exhaust gas temperatures, (n, 4)."""
        time_s = (self._samples + np.arange(len(charge))) * DT_S
        beat = 1.0 + C.egt_valve_beat * np.sin(2.0 * np.pi * time_s / C.egt_valve_beat_s)
        burning = (
            C.egt_degf
            + C.egt_per_log_charge_degf * np.log(np.maximum(charge, 0.05))[:, None]
            + C.egt_per_lean_degf * effects.lean
            - C.egt_lean_curvature_degf * np.abs(effects.lean) * effects.lean
            + C.egt_per_exhaust_leak_degf * effects.exhaust_leak * beat[:, None]
            + C.egt_per_charge_loss_degf * effects.charge_loss
            + self._airframe.egt_offset_degf
        )
        target: Array = effects.firing * burning + (1.0 - effects.firing) * C.egt_unburnt_degf
        return target


def _column(states: Array, name: str) -> Array:
    column: Array = states[:, STATE_INDEX[name]]
    return column


def _charge(states: Array) -> Array:
    """Air charge flow relative to the reference cruise."""
    flow: Array = _column(states, "rpm") * _column(states, "map_inhg") / 1000.0
    return flow / C.charge_reference


def _oil_target(states: Array, effects: Effects, charge: Array, air_degf: Array) -> Array:
    """Quasi-steady oil temperature, (n,): heat in over (sump + cooler) conductance."""
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
    conductance = airflow * (
        (1.0 - C.oil_cooler_share) * volume**C.oil_sump_exponent
        + C.oil_cooler_share * effects.cooler_efficiency
    )
    target: Array = air_degf + C.oil_degf_above_air * heat / conductance
    return target


def _oil_pressure(rpm: Array, oil_degf: Array, effects: Effects) -> Array:
    """Oil pressure from pump speed, viscosity (temperature) and what is left to pump."""
    warm = np.minimum(oil_degf, C.oil_hot_degf) - _OIL_PSI_AT_DEGF
    hot = np.maximum(oil_degf - C.oil_hot_degf, 0.0)
    pump = np.interp(rpm, _OIL_PSI_RPM, _OIL_PSI)
    feed = np.minimum(rpm / 2000.0, 1.0)
    pressure: Array = (
        pump
        + feed * (C.oil_psi_per_degf * warm + C.oil_psi_per_degf_hot * hot)
        + feed * C.oil_psi_per_qt * effects.oil_lost_qt
    )
    return np.maximum(pressure, 0.0)
