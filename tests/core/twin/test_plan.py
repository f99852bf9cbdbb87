"""Plans and faults reject what cannot be flown, naming the field and its range."""

import json
import pickle
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from core.errors import InputError
from core.fmea.fault import Fault
from core.twin.plan import PLAN_RANGES, Leg, Plan, Weather, load_plan


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"altitude_ft": 90_000}, "altitude_ft: must lie in 2000 to 9000 ft, got 90000"),
        ({"speed_kt": "fast"}, "speed_kt: must be a number, got 'fast'"),
        ({"duration_s": float("nan")}, "duration_s: must lie in 30 to 7200 s"),
        ({"seed": 1.5}, "seed: must be a whole number"),
        ({"seed": -1}, "seed: must lie in 0 to"),
        ({"power": "full"}, "power: must be fixed or speed_hold"),
        ({"conditions": "moon"}, "conditions: must be lab or field"),
        ({"alltitude_ft": 5000}, "alltitude_ft: is not a plan field; those are altitude_ft"),
        ({"weather": {"rain": 1}}, "weather.rain: is not a weather field"),
        ({"weather": {"wind_kt": 400}}, "wind_kt: must lie in 0 to 40 kt"),
        ({"weather": 3}, "weather: must be a table"),
    ],
)
def test_bad_plan_is_named(values: dict[str, object], message: str) -> None:
    with pytest.raises(InputError) as caught:
        Plan.from_dict(values)
    assert str(caught.value).startswith(message)


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"mode": "warp_core"}, "fault: unknown mode 'warp_core'; one of nominal, baffle_crack"),
        ({"mode": "baffle_seal", "severity": 7}, "severity: must lie in 0 to 1, got 7"),
        ({"mode": "baffle_seal", "onset_s": -1}, "onset_s: must lie in 0 to 7200 s"),
        ({"mode": "baffle_seal", "cylinder": 5}, "cylinder: must be 1, 2, 3 or 4"),
        ({"moed": "baffle_seal"}, "moed: is not a fault field"),
    ],
)
def test_bad_fault_is_named(values: dict[str, object], message: str) -> None:
    with pytest.raises(InputError) as caught:
        Fault.from_dict(values)
    assert str(caught.value).startswith(message)


@given(st.integers(0, 2**31 - 1))
def test_sampled_plans_lie_in_the_papers_box(seed: int) -> None:
    plan = Plan.sampled(seed)
    assert 4500.0 <= plan.altitude_ft <= 5500.0
    assert 90.0 <= plan.speed_kt <= 110.0
    assert plan == Plan.sampled(seed)


def test_plans_and_faults_survive_json() -> None:
    plan = Plan(altitude_ft=4700.0, seed=9, weather=Weather(wind_kt=10.0), legs=(Leg(5.0, 5000.0),))
    fault = Fault("cylinder_crack", 0.4, 12.0, 3)
    assert Plan.from_dict(json.loads(json.dumps(plan.to_dict()))) == plan
    assert json.loads(json.dumps(plan.to_dict())) == plan.to_dict()
    assert Fault.from_dict(fault.to_dict()) == fault


def test_plan_file(tmp_path: Path) -> None:
    path = tmp_path / "plan.toml"
    path.write_text("altitude_ft = 5200\n[weather]\nwind_kt = 5\n")
    assert load_plan(path) == Plan(altitude_ft=5200.0, weather=Weather(wind_kt=5.0))
    path.write_text("altitude_ft = = 5200")
    with pytest.raises(InputError, match="is not TOML"):
        load_plan(path)
    with pytest.raises(InputError, match="cannot read"):
        load_plan(tmp_path / "absent.toml")


def test_ranges_cover_the_defaults() -> None:
    for part in (Plan(), Weather(), Leg(0.0)):
        for name, (low, high, _) in PLAN_RANGES.items():
            value = getattr(part, name, None)
            assert value is None or low <= value <= high


def test_an_input_error_survives_the_way_from_a_worker() -> None:
    error = pickle.loads(pickle.dumps(InputError("severity", "must lie in 0 to 1, got 7")))
    assert (error.field, str(error)) == ("severity", "severity: must lie in 0 to 1, got 7")
