"""What the field adds is nothing in lab: exactly nothing, so that lab flights keep their bytes."""

import xml.etree.ElementTree as ElementTree

import numpy as np

from core.channels import CHANNELS, N_CHANNELS
from core.paths import DATA
from core.twin.avionics import Avionics
from core.twin.conditions import flown, mirrored
from core.twin.noise import SensorNoise
from core.twin.pilot import Pilot
from core.twin.plan import Leg, Plan

LAB = Plan(seed=31)


def test_the_lab_aircraft_is_the_reference():
    setting = flown(LAB)
    airframe = setting.airframe
    assert setting.hand_stream is None
    assert (airframe.head_heat, airframe.oil_heat) == (1.0, 1.0)
    assert airframe.oil_offset_psi == 0.0
    assert airframe.bus_offset_volt == airframe.battery_offset_amp == (0.0, 0.0)
    assert mirrored(LAB).noise_stream == setting.noise_stream


def test_lab_noise_is_white_at_the_level_of_the_channel():
    noise = SensorNoise(flown(LAB))
    drawn = np.concatenate([noise.next(70), noise.next(30)])
    rng = np.random.default_rng((LAB.seed, 0x0153))
    levels = np.array([channel.noise_sd for channel in CHANNELS])
    assert drawn.tobytes() == (rng.standard_normal((100, N_CHANNELS)) * levels).tobytes()


def test_lab_logs_what_its_sensors_read():
    readings = np.random.default_rng(1).normal(size=(50, N_CHANNELS))
    assert Avionics(flown(LAB)).log(readings) is readings


def test_a_lab_leg_is_a_step_for_the_speed_loop():
    pilot = Pilot(Plan(legs=(Leg(0.2, speed_kt=90.0),)))
    assert [pilot.next().speed_kt for _ in range(4)] == [100.0, 100.0, 90.0, 90.0]


def test_the_autopilot_flies_by_hand_only_when_told():
    system = ElementTree.parse(DATA / "aircraft" / "mirrortwin_autopilot.xml").getroot()
    declared = [one for one in system.iter("property") if one.get("value") is not None]
    initial = {(one.text or "").strip(): one.get("value") for one in declared}
    assert initial["ap/by-hand"] == "0"
    assert initial["ap/power-for-climb-fps"] == "0"


def test_the_autopilot_is_guarded_only_when_somebody_acts():
    system = ElementTree.parse(DATA / "aircraft" / "mirrortwin_autopilot.xml").getroot()
    declared = [one for one in system.iter("property") if one.get("value") is not None]
    initial = {(one.text or "").strip(): one.get("value") for one in declared}
    assert initial["ap/guarded"] == "0"
    assert initial["ap/throttle-offset-least-norm"] == "-0.7"
    assert initial["ap/throttle-offset-most-norm"] == "0.3"
    (red_line,) = (one for one in system.iter("channel") if one.get("name") == "Red line")
    assert red_line.get("execute") == "ap/guarded"
