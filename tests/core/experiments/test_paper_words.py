"""The paper's own words on its simulated flights (section 6.2), each as a measurement.

Conditions are the paper's: lab, here with the throttle left alone, severity 0.8 from 01:00 on.
"""

import numpy as np
import pytest

from core.channels import CHANNEL_INDEX, CHANNEL_NAMES, channel, cht_name, egt_name
from core.cylinders import CYLINDERS
from core.experiments.drawing import means
from core.experiments.paper.fig6 import departure
from core.experiments.paper.representative import (
    CYLINDER,
    FIGURES_ONSET_S,
    FIGURES_PLAN,
    NOMINAL,
    fly_modes,
)
from core.fmea.catalogue import class_ids
from core.twin.trajectory import Pair

FAULTS = [mode for mode in class_ids() if mode != NOMINAL]


@pytest.fixture(scope="module")
def pairs() -> dict[str, Pair]:
    return fly_modes(FIGURES_PLAN, class_ids(), lambda share: None)


@pytest.fixture(scope="module")
def left(pairs: dict[str, Pair]) -> dict[str, dict[str, float]]:
    """How far each mode leaves its mirror."""
    return {mode: departure(pair) for mode, pair in pairs.items()}


def _residual(pair: Pair, name: str) -> np.ndarray:
    """The paired residual of a channel, (300,) means over a second."""
    return means(pair.residual[:, CHANNEL_INDEX[name]].astype(np.float64))


def _at_the_end(pair: Pair, name: str) -> float:
    return float(_residual(pair, name)[-30:].mean())


def test_engine_failure_loses_altitude_fastest_of_all_modes(left):
    others = [mode for mode in FAULTS if mode != "engine_failure"]
    for figure in ("altitude_lost_ft", "sink_fpm", "power_lost_percent"):
        worst = max(left[mode][figure] for mode in others)
        assert left["engine_failure"][figure] > 5.0 * max(worst, 1.0)


def test_engine_failure_decays_exponentially_to_next_to_no_power(pairs, left):
    assert left["engine_failure"]["power_lost_percent"] > 90.0
    power = means(pairs["engine_failure"].faulted.state("power_hp"))
    lost = power[int(FIGURES_ONSET_S) :] / power[int(FIGURES_ONSET_S) - 1]
    assert lost[10] < 0.6
    assert lost[20] < 0.6 * lost[10]


@pytest.mark.parametrize(
    "name", ["E1 RPM", "E1 OilP", *map(cht_name, CYLINDERS), *map(egt_name, CYLINDERS), "AltMSL"]
)
def test_engine_failure_pulls_the_whole_engine_down(pairs, name):
    fallen = _residual(pairs["engine_failure"], name)[int(FIGURES_ONSET_S) + 20 :]
    assert np.all(fallen < -3.0 * channel(name).sigma)


def test_cylinder_compression_costs_about_7_5_percent_of_power(left):
    assert 6.0 < left["cylinder_compression"]["power_lost_percent"] < 9.0


def test_cylinder_compression_descends_slowly_and_discernibly(pairs, left):
    height = _residual(pairs["cylinder_compression"], "AltMSL")[int(FIGURES_ONSET_S) :]
    by_minute = height[:240].reshape(4, 60).mean(axis=1)
    assert np.all(np.diff(by_minute) < 0.0)
    assert 3.0 * channel("AltMSL").sigma < left["cylinder_compression"]["altitude_lost_ft"] < 100.0
    assert left["cylinder_compression"]["sink_fpm"] < 30.0


@pytest.mark.parametrize("mode", ["baffle_crack", "oil_cooler_maintenance"])
def test_cooling_and_oil_faults_fly_the_nominal_path(left, mode):
    """Not merely nearly: they reach nothing that flies, so the paths differ by 0 ft."""
    assert left[mode]["max_separation_ft"] == 0.0


def test_intake_gasket_leak_flies_slightly_lower_but_stable(pairs, left):
    lost = left["intake_gasket_leak"]["altitude_lost_ft"]
    assert 1.0 < lost < 0.5 * left["cylinder_compression"]["altitude_lost_ft"]
    height = _residual(pairs["intake_gasket_leak"], "AltMSL")
    assert abs(height[-1] - height[-60]) < 1.0


def test_baffle_crack_heats_its_cylinder_and_spares_the_oil(pairs):
    crack = pairs["baffle_crack"]
    rise = _at_the_end(crack, cht_name(CYLINDER))
    assert rise > 10.0
    for cylinder in set(CYLINDERS) - {CYLINDER}:
        assert abs(_at_the_end(crack, cht_name(cylinder))) < 0.25 * rise
    assert abs(_at_the_end(crack, "E1 OilT")) < 1.0
    assert abs(_at_the_end(crack, "E1 OilP")) < channel("E1 OilP").sigma


def test_oil_cooler_couples_temperature_and_pressure(pairs):
    """Continuous rise, viscosity down, symmetric fall."""
    warmer = _residual(pairs["oil_cooler_maintenance"], "E1 OilT")[int(FIGURES_ONSET_S) + 1 :]
    weaker = _residual(pairs["oil_cooler_maintenance"], "E1 OilP")[int(FIGURES_ONSET_S) + 1 :]
    assert np.all(np.diff(warmer) > 0.0)
    assert warmer[-1] > 13.0
    assert weaker[-1] < -1.3
    assert np.corrcoef(warmer, weaker)[0, 1] < -0.99


def test_the_clearest_sign_of_an_intake_gasket_leak_is_its_egt(pairs):
    leak = pairs["intake_gasket_leak"]
    clarity = {name: abs(_at_the_end(leak, name)) / channel(name).sigma for name in CHANNEL_NAMES}
    assert max(clarity, key=clarity.__getitem__) == egt_name(CYLINDER)
    assert _at_the_end(leak, egt_name(CYLINDER)) > 25.0


def test_responses_differ_from_mode_to_mode(pairs):
    """No two of the 19 modes end with the same residual, so none is another by a new name."""
    ends = {mode: pairs[mode].residual[-1500:].mean(axis=0) for mode in FAULTS}
    sds = np.array([channel(name).sigma for name in CHANNEL_NAMES])
    for one in FAULTS:
        for other in FAULTS:
            if one < other:
                assert np.abs((ends[one] - ends[other]) / sds).max() > 1.0, (one, other)
