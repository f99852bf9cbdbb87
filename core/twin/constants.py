"""Every constant of the sensor equations, with its unit in its name and its source beside it.

[D] computed from real G1000 logs, [K] engineering judgement, S# a source: all as in
``assets/facts/fmea.md``. Kept as one frozen table so that an experiment can vary it.
"""

from dataclasses import dataclass

import numpy as np


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
    windmilling: float = 0.16  # head heat of an unfired engine, share of a fired one [K]
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
    vernatherm_least: float = 0.70  # share of oil through the cooler when cold [K]
    vernatherm_opens_degf: float = 118.0  # at the sender, behind the cooler [K]
    vernatherm_open_degf: float = 162.0  # 180 F in the valve itself (fmea.md S13)
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

CRUISE_MIXTURE = 0.93
"""The mixture lever in cruise at 5,000 ft, 1 full rich: slightly rich of JSBSim's best power, as a
carburetted 172 is flown below 75 % power. Elsewhere it follows the air pressure, which keeps the
air-fuel ratio: JSBSim's is 14.7 / 1.3 at full rich and sea level, and falls with the pressure."""

CRUISE_PSF = 1760.9
"""Air pressure at 5,000 ft in the standard atmosphere."""
CRUISE_AIR_FUEL_RATIO = 14.7 / (1.3 * CRUISE_MIXTURE * 2116.22 / CRUISE_PSF)

OIL_PSI_RPM = np.array([0.0, 300.0, 700.0, 900.0, 1150.0, 1500.0, 1850.0, 2150.0, 2400.0, 2550.0,
                         3000.0])  # fmt: skip
OIL_PSI = np.array([0.0, 38.0, 53.0, 57.0, 60.0, 64.0, 67.5, 70.4, 72.2, 73.6, 77.4])
"""Oil pressure against engine speed at 150-165 F, three real logs [D]."""
OIL_PSI_AT_DEGF = 162.0
