"""The bar of a live flight: what its buttons stand for, and how it tells what was done."""

import math

import pytest
from dash._utils import to_json

from app.kit.words import live_caution
from app.pages.fly import live_controls
from app.pages.fly.live_controls import action_lines, action_list, button_id, paced, read_action
from core.errors import InputError
from core.fmea.fault import Fault
from core.twin.actions import Repair, SetFault, SetTarget

VALUES = {"fault": "baffle_crack", "severity": 0.4, "altitude_ft": 5500, "speed_kt": ""}


def test_each_button_stands_for_an_action_now() -> None:
    assert read_action(button_id("inject"), VALUES) == SetFault(0.0, "baffle_crack", 0.4)
    assert read_action(button_id("repair"), VALUES) == Repair(0.0)
    assert read_action(button_id("target"), VALUES) == SetTarget(0.0, altitude_ft=5500.0)


@pytest.mark.parametrize(
    ("button", "changes", "field"),
    [
        ("inject", {"severity": ""}, "severity"),
        ("inject", {"severity": 3}, "severity"),
        ("inject", {"fault": "nonsense"}, "fault"),
        ("target", {"altitude_ft": None}, "altitude_ft"),
        ("target", {"altitude_ft": 90000}, "altitude_ft"),
        ("target", {"speed_kt": 300}, "speed_kt"),
    ],
)
def test_what_cannot_be_done_names_a_field_of_the_bar(
    button: str, changes: dict[str, object], field: str
) -> None:
    with pytest.raises(InputError) as caught:
        read_action(button_id(button), VALUES | changes)
    assert caught.value.field == field
    assert field in live_controls.FIELDS


def test_the_form_offers_paces() -> None:
    assert live_controls.read_pace(live_controls.NO_PACE) is None
    assert live_controls.read_pace("60") == 60.0
    for wrong in ("7", "nan", "fast"):
        with pytest.raises(InputError, match="pace"):
            live_controls.read_pace(wrong)


def test_the_bar_shows_the_pace_that_is_flown() -> None:
    shown = paced(math.inf, is_paused=True)
    assert shown["live-pause", "children"] == "Resume"
    pressed = [name for (name, prop), value in shown.items() if value == "true"]
    assert pressed == ["live-pace-inf"]


def test_what_was_done_is_told_in_the_order_of_time() -> None:
    actions = [
        SetTarget(150.0, 5200.0, 95.0),
        SetFault(30.0, "baffle_crack", 0.5),
        SetFault(61.0, "baffle_crack", 0.9),
        Repair(90.0),
        SetFault(95.0, "baffle_crack", 0.2),
    ]
    words = [line for _, line in action_lines(Fault(), actions)]
    assert words == [
        "Baffle crack injected, severity 0.50",
        "Baffle crack: severity 0.90",
        "Engine repaired",
        "Baffle crack injected, severity 0.20",
        "New targets: 5,200 ft, 95 kt",
    ]
    listed = to_json(action_list(action_lines(Fault(), actions)))
    assert listed.index("2:30") < listed.index("0:30")
    assert action_list([]) is None
    many = to_json(action_list(action_lines(Fault(), [Repair(float(at)) for at in range(12)])))
    assert "and 4 earlier" in many


@pytest.mark.parametrize(
    ("actions", "now_s", "said"),
    [
        ((), 100.0, None),
        ((SetFault(96.0, "engine_failure"),), 200.0, None),
        ((SetFault(96.0, "engine_failure"), Repair(352.0)), 351.0, None),
        ((SetFault(96.0, "engine_failure"), Repair(352.0)), 900.0, "Repaired at 5:52"),
        ((Repair(352.0), SetFault(400.0, "baffle_crack")), 500.0, None),
        ((SetTarget(398.0, altitude_ft=5000.0),), 420.0, "New targets at 6:38"),
        ((SetTarget(398.0, altitude_ft=5000.0),), 600.0, None),
    ],
)
def test_a_ranking_that_says_little_is_not_left_alone(actions, now_s, said):
    """ux.md D4: a repaired engine was called broken, in full colour."""
    caution = live_caution(actions, now_s)
    assert (caution or "").startswith(said or "")
    assert (caution is None) == (said is None)
