"""Field conditions: what the mirror does not know shows, and what it should know does not."""

from dataclasses import replace

import numpy as np
import pytest

from core.channels import CHANNELS, channel
from core.errors import FlightError, InputError
from core.experiments.realism.cruise import white_sd
from core.fmea.fault import Fault
from core.twin.constants import CRUISE_AIR_FUEL_RATIO, CRUISE_MIXTURE
from core.twin.events import flight_events
from core.twin.flight import PairFlight, fly, fly_pair
from core.twin.plan import Leg, Plan, Weather
from core.twin.trajectory import STATE_INDEX, Trajectory

NOMINAL = Fault("nominal")
SMOOTH = Weather(isa_deviation_degc=8.0, wind_kt=12.0, wind_from_deg=240.0, turbulence=1.0)
FIELD = Plan(duration_s=120.0, seed=4, conditions="field", weather=SMOOTH)


def test_field_residual_of_a_healthy_aircraft_is_small_but_not_zero() -> None:
    residual = fly_pair(FIELD, NOMINAL).residual
    for item, column in zip(CHANNELS, residual.T, strict=True):
        assert np.any(column) or item.subsystem == "electrical", item.name
        assert np.abs(column.mean()) < 0.15 * item.full_scale, item.name


def test_field_is_logged_in_the_steps_of_the_real_log() -> None:
    flight = fly(FIELD)
    for item in CHANNELS:
        steps = flight.channel(item.name).astype(float) / item.resolution
        assert np.allclose(steps, np.round(steps), atol=0.02), item.name


def test_field_differs_only_by_the_fault_too() -> None:
    """The same seed gives the same gusts and the same noise with and without a fault."""
    healthy = fly(FIELD)
    faulted = fly(FIELD, Fault("baffle_crack", 0.8, 60.0))
    assert healthy.channels[:3000].tobytes() == faulted.channels[:3000].tobytes()


def test_gusts_move_speed_and_rpm_together() -> None:
    flight = fly(FIELD)
    speed, rpm = flight.state("ias_kt")[::50], flight.state("rpm")[::50]
    assert np.corrcoef(speed, rpm)[0, 1] > 0.7


def test_white_noise_is_at_the_measured_level() -> None:
    """Of a handful of aircraft together: no two are equally noisy."""
    plans = [Plan(duration_s=200.0, seed=seed, conditions="field") for seed in range(5)]
    flights = [fly(plan) for plan in plans]
    for name in ("E1 OilP", "E1 FFlow", "volt1", "E1 CHT1", "E1 EGT3", "FQtyL"):
        second = [np.diff(flight.channel(name)[::50].astype(float), 2) for flight in flights]
        assert white_sd(np.concatenate(second)) == pytest.approx(channel(name).noise_sd, rel=0.5)


def test_legs_are_flown() -> None:
    legs = (Leg(30.0, altitude_ft=5500.0), Leg(180.0, speed_kt=90.0, heading_deg=120.0))
    flight = fly(Plan(duration_s=360.0, heading_deg=30.0, legs=legs))
    at = {second: second * 50 for second in (20, 170, 355)}
    assert flight.state("altitude_ft")[at[20]] == pytest.approx(5000.0, abs=5.0)
    assert flight.state("altitude_ft")[at[170]] == pytest.approx(5500.0, abs=40.0)
    assert flight.state("ias_kt")[at[355]] == pytest.approx(90.0, abs=2.0)
    assert flight.state("heading_deg")[at[355]] == pytest.approx(120.0, abs=2.0)


def test_a_pair_with_legs_is_identical_before_onset() -> None:
    plan = Plan(duration_s=60.0, legs=(Leg(10.0, altitude_ft=5200.0, speed_kt=95.0),))
    residual = fly_pair(plan, Fault("engine_failure", 0.8, 40.0)).residual
    assert not np.any(residual[:2000])
    assert np.any(residual[2000:])


@pytest.mark.parametrize(
    ("legs", "message"),
    [
        ([{"start_s": 400.0}], "legs: must start one after the other, before the end"),
        ([{"start_s": 50.0}, {"start_s": 10.0}], "legs: must start one after the other"),
        ([{"begin": 50.0}], "legs: must be tables with start_s"),
        ([{"start_s": 5.0, "speed_kt": 300.0}], "speed_kt: must lie in 80 to 115 kt"),
    ],
)
def test_bad_legs_are_named(legs: list[dict[str, float]], message: str) -> None:
    with pytest.raises(InputError, match=message):
        Plan.from_dict({"legs": legs})


def test_turbulence_is_a_level() -> None:
    with pytest.raises(InputError, match="turbulence: must be 0, 1, 2, 3 or 4"):
        Plan(weather=Weather(turbulence=1.5))


def test_the_mixture_lever_moves_exhaust_and_fuel_flow_apart() -> None:
    legs = (Leg(30.0, mixture=1.0), Leg(90.0, mixture=0.86))
    flight = fly(Plan(duration_s=180.0, conditions="field", legs=legs))
    rich, lean = slice(3500, 4500), slice(8000, 9000)
    full_rich = CRUISE_AIR_FUEL_RATIO * CRUISE_MIXTURE
    assert flight.state("air_fuel_ratio")[rich].mean() == pytest.approx(full_rich, rel=0.01)
    egt, fuel = flight.channel("E1 EGT2"), flight.channel("E1 FFlow")
    assert egt[lean].mean() > egt[rich].mean() + 80.0
    assert fuel[lean].mean() < 0.92 * fuel[rich].mean()


@pytest.mark.parametrize("altitude_ft", [4000.0, 5000.0, 9000.0])
def test_cruise_is_leaned_for_its_altitude(altitude_ft: float) -> None:
    flight = fly(Plan(altitude_ft, 90.0, duration_s=30.0))
    ratio = flight.state("air_fuel_ratio")
    assert ratio == pytest.approx(np.full(len(ratio), CRUISE_AIR_FUEL_RATIO), rel=0.002)


def test_below_3000_ft_even_full_rich_is_leaner_than_cruise() -> None:
    flight = fly(Plan(2000.0, 90.0, duration_s=30.0))
    assert flight.state("air_fuel_ratio").mean() > 1.03 * CRUISE_AIR_FUEL_RATIO


def test_the_pilot_leans_in_a_climb() -> None:
    flight = fly(Plan(4000.0, 85.0, duration_s=400.0, legs=(Leg(10.0, altitude_ft=6500.0),)))
    assert flight.state("altitude_ft")[-1] > 6300.0
    ratio = flight.state("air_fuel_ratio")
    assert ratio == pytest.approx(np.full(len(ratio), CRUISE_AIR_FUEL_RATIO), rel=0.003)


@pytest.mark.parametrize(
    ("altitude_ft", "speed_kt", "isa_deviation_degc"), [(9000.0, 115.0, 0.0), (8000.0, 110.0, 25.0)]
)
def test_a_cruise_past_the_red_line_is_refused(
    altitude_ft: float, speed_kt: float, isa_deviation_degc: float
) -> None:
    weather = Weather(isa_deviation_degc=isa_deviation_degc)
    with pytest.raises(FlightError, match="below 2700 rpm: choose a lower speed or altitude"):
        fly(Plan(altitude_ft, speed_kt, duration_s=30.0, weather=weather))


def test_the_fastest_cruise_that_is_not_refused_stays_within_every_limit() -> None:
    hot = Weather(isa_deviation_degc=25.0)
    for altitude_ft, speed_kt in ((2000.0, 115.0), (6000.0, 110.0), (9000.0, 105.0)):
        flight = fly(Plan(altitude_ft, speed_kt, duration_s=300.0, weather=hot))
        assert flight_events(flight) == (), (altitude_ft, speed_kt)


def test_thermocouples_share_their_cold_junction() -> None:
    flight = fly(FIELD)
    steps = [np.diff(flight.channel(f"E1 CHT{cylinder}")[::50], 2) for cylinder in (1, 2, 3, 4)]
    assert np.corrcoef(steps)[np.triu_indices(4, 1)].min() > 0.8


def test_field_blocks_of_any_size_give_the_same_bytes() -> None:
    plan = Plan(
        duration_s=90.0, seed=6, conditions="field", weather=SMOOTH, legs=(Leg(20.0, 5200.0),)
    )
    flight, blocks = PairFlight(plan, NOMINAL), []
    for seconds in (0.1, 7.3, 61.7, 60.0):
        if (block := flight.advance(seconds)) is not None:
            blocks.append(block)
    whole = fly_pair(plan, NOMINAL)
    for cut, joined in (
        ([block.faulted for block in blocks], whole.faulted),
        ([block.mirror for block in blocks], whole.mirror),
    ):
        assert Trajectory.joined(cut).channels.tobytes() == joined.channels.tobytes()


def test_a_steady_wind_carries_the_aircraft_and_nothing_else():
    calm = Plan(altitude_ft=5000.0, speed_kt=100.0, heading_deg=0.0, duration_s=60.0)
    windy = replace(calm, weather=Weather(wind_kt=30.0, wind_from_deg=90.0))
    still, blown = fly(calm), fly(windy)
    np.testing.assert_array_equal(blown.channels, still.channels)
    east, north = (STATE_INDEX[name] for name in ("east_m", "north_m"))
    drift_m = blown.states[:, east] - still.states[:, east]
    assert drift_m == pytest.approx(-30.0 * 1852.0 / 3600.0 * still.time_s, abs=1e-6)
    assert blown.states[:, north] == pytest.approx(still.states[:, north], abs=1e-6)
