"""Layers 2 and 3: defects to engine factors and effects; the catalogue that feeds them."""

from pathlib import Path

import numpy as np
import pytest

from core.errors import InputError
from core.fmea.catalogue import catalogue, class_ids, read_catalogue
from core.fmea.defects import DEFECT_SLICE, ENGINE_WIDE, MOVES_ENGINE, N_DEFECTS, PER_CYLINDER
from core.fmea.effects import effects_of
from core.fmea.fault import Fault
from core.fmea.injection import FaultState
from core.fmea.laws import REFERENCE_QBAR_PSF, REFERENCE_RPM, Drivers
from core.fmea.plenum import cooling
from core.fmea.powerplant import CARRIERS, HEALTHY, engine_factors


def _with(**sizes: float | list[float]) -> np.ndarray:
    defects = np.zeros(N_DEFECTS)
    for name, size in sizes.items():
        defects[DEFECT_SLICE[name]] = size
    return defects


def test_the_classes_begin_with_the_healthy_one_and_know_the_four_laws() -> None:
    ids = class_ids()
    assert ids[0] == "nominal"
    assert {mode.law for mode in catalogue().values()} >= {
        "exponential approach", "linear accumulation", "fatigue accumulation",
        "threshold-triggered",
    }  # fmt: skip


@pytest.mark.parametrize("mode", [m for m in class_ids() if m != "nominal"])
def test_size_grows_with_severity_from_exactly_zero(mode: str) -> None:
    for drive in catalogue()[mode].drives:
        sizes = [drive.size(s) for s in (0.0, 0.1, 0.3, 0.6, 1.0)]
        assert sizes[0] == 0.0
        assert sizes == sorted(sizes)
        assert sizes[2] == pytest.approx(drive.mild)
        assert sizes[4] == pytest.approx(drive.severe)


def test_healthy_engine_is_left_untouched() -> None:
    assert engine_factors([0.0] * N_DEFECTS) == HEALTHY


@pytest.mark.parametrize("mode", class_ids())
def test_every_mode_says_which_jsbsim_parameters_carry_it_and_why(mode: str) -> None:
    """And means those that it moves while it grows, no more and no fewer."""
    fault, cruise = (
        FaultState(Fault(mode, 0.8, 0.0), 5),
        Drivers(REFERENCE_RPM, REFERENCE_QBAR_PSF, 100.0),
    )
    moved = set()
    for _ in range(2400):
        factors = engine_factors(fault.step(cruise))
        moved |= {
            name for name, field in CARRIERS.items()
            if getattr(factors, field) != getattr(HEALTHY, field)
        }  # fmt: skip
    stated = catalogue()[mode]
    assert set(stated.jsbsim) == moved
    assert len(stated.jsbsim_because) > 60 or mode == "nominal"
    assert stated.moves_engine == bool(moved)


@pytest.mark.parametrize("name", sorted(MOVES_ENGINE))
def test_defects_that_move_the_engine_do(name: str) -> None:
    assert engine_factors(_with(**{name: 0.1}).tolist()) != HEALTHY


@pytest.mark.parametrize("name", sorted(set(ENGINE_WIDE + PER_CYLINDER) - MOVES_ENGINE))
def test_defects_that_spare_the_engine_do(name: str) -> None:
    assert engine_factors(_with(**{name: 0.1}).tolist()) == HEALTHY


def test_plenum_against_the_hand_worked_network() -> None:
    """5 in2 more leak: deck share 0.846 of before, cooling 0.945, cooler 0.882."""
    air = cooling(_with(plenum_leak_in2=5.0)[None])
    deck, leaking = 1 / 35.0**2, 1 / 40.0**2
    series = 1 / 45.0**2 + 1 / 38.0**2
    ratio = (leaking / (series + leaking)) / (deck / (series + deck))
    assert ratio == pytest.approx(0.846, abs=0.002)
    np.testing.assert_allclose(air.heads, ratio**0.34)
    np.testing.assert_allclose(air.cooler, ratio**0.75)


def test_a_local_leak_heats_its_cylinder_most_and_its_bank_mate_more_than_the_rest() -> None:
    heads = cooling(_with(local_leak_in2=[0.0, 0.0, 2.0, 0.0])[None]).heads[0]
    assert heads[2] < 0.92
    assert heads[2] < heads[0] < heads[1] == heads[3]
    assert heads[1] > 0.98


def test_effects_of_a_healthy_engine_are_neutral() -> None:
    effects = effects_of(np.zeros((3, N_DEFECTS)))
    assert np.all(effects.cooling_efficiency == 1.0)
    assert np.all(effects.cooler_efficiency == 1.0)
    assert np.all(effects.firing == 1.0)
    for name in ("lean", "exhaust_leak", "charge_loss", "gas_jet", "oil_lost_qt", "friction"):
        assert not np.any(getattr(effects, name))


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('defect = "oil_lost_qt"', 'defect = "chc"', "unknown defect 'chc'"),
        ('where = "bank"', 'where = "engine"', "wrap_loss can be at target, .* got 'engine'"),
        ("occurrence = 7", "occurrence = 11", "ratings must be 1-10"),
        ('["friction-hp"]', '["friction"]', "unknown parameter 'friction'; one of throttle"),
        ("prior = [0.41,", "prior = [0.91,", "shares that sum to 1"),
        ('law = "fatigue accumulation"\n', "", "law: is missing"),
        ("[nominal]", "[nominal", "catalogue"),
    ],
)
def test_bad_catalogue_is_named(tmp_path: Path, old: str, new: str, message: str) -> None:
    good = (Path(__file__).parents[3] / "assets" / "data" / "fmea" / "catalogue.toml").read_text()
    path = tmp_path / "catalogue.toml"
    path.write_text(good.replace(old, new, 1))
    with pytest.raises(InputError, match=message):
        read_catalogue(path)
