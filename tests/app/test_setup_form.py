"""The form: what it says is what is flown, and what is wrong is named."""

from typing import Any

import pytest

from app.kit.words import takes_cylinder
from app.pages.fly.setup import (
    DEFAULT_FAULT,
    DEFAULT_PLAN,
    FIELDS,
    form_values,
    read_form,
    setup_panel,
)
from core.errors import InputError
from core.fmea.catalogue import catalogue
from core.fmea.fault import Fault
from core.twin.plan import Plan, Weather


def values(**changes: Any) -> dict[str, Any]:
    return form_values(DEFAULT_PLAN, DEFAULT_FAULT) | changes


def test_the_form_reads_back_what_it_is_filled_with() -> None:
    plan = Plan(
        altitude_ft=6500.0,
        speed_kt=92.5,
        heading_deg=271.0,
        duration_s=600.0,
        seed=11,
        power="speed_hold",
        conditions="field",
        weather=Weather(isa_deviation_degc=-7.5, wind_kt=12.0, wind_from_deg=300.0, turbulence=2),
    )
    fault = Fault("baffle_crack", severity=0.35, onset_s=125.0, cylinder=3)
    filled = form_values(plan, fault)
    assert set(filled) == set(FIELDS)
    assert read_form(filled) == (plan, fault)


def test_the_first_run_is_one_that_shows_something() -> None:
    plan, fault = read_form(values())
    assert fault.mode != "nominal"
    assert fault.severity >= 0.8
    assert fault.onset_s < plan.duration_s / 2


@pytest.mark.parametrize(
    ("field", "value", "said"),
    [
        ("altitude_ft", 90_000, "2000 to 9000 ft"),
        ("altitude_ft", "", "2000 to 9000 ft"),
        ("speed_kt", 300, "80 to 115 kt"),
        ("heading_deg", None, "0 to 360 deg"),
        ("duration_s", 5, "30 to 7200 s"),
        ("seed", 1.5, "whole number"),
        ("seed", -1, "0 to"),
        ("power", "full", "fixed or speed_hold"),
        ("conditions", "space", "lab or field"),
        ("wind_kt", 99, "0 to 40 kt"),
        ("fault", "gremlins", "unknown mode"),
        ("severity", 7, "0 to 1"),
        ("onset_s", 400, "before the end of the flight"),
        ("onset_s", "soon", "must be a number"),
        ("cylinder", "9", "1, 2, 3 or 4"),
        ("cylinder", "left", "1, 2, 3 or 4"),
    ],
)
def test_an_error_names_its_field_and_the_range(field: str, value: Any, said: str) -> None:
    with pytest.raises(InputError) as caught:
        read_form(values(**{field: value}))
    assert caught.value.field == field
    assert said in caught.value.problem


def test_every_mode_can_be_chosen_under_its_subsystem() -> None:
    (select,) = (
        component
        for component in setup_panel()._traverse()
        if getattr(component, "id", None) == "field-fault"
    )
    offered = {item["value"] for group in select.data for item in group["items"]}
    assert offered == set(catalogue())
    assert len(select.data) > 3


def test_only_modes_of_one_cylinder_take_one() -> None:
    assert takes_cylinder("cylinder_crack")
    assert not takes_cylinder("engine_failure")
    assert not takes_cylinder("nominal")
