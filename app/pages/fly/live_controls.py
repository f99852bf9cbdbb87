"""The controls of a live flight, and the list of actions taken.

The state of the flight is the server's: these controls only show it (`paced`, `action_list`), so
that two browsers on one flight never disagree.
"""

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

import dash_mantine_components as dmc
from dash import html

from app.kit.attributes import attributes
from core.channels import unit_label
from core.clock import clock
from core.errors import InputError
from core.fmea.catalogue import catalogue
from core.fmea.fault import Fault
from core.jobs.live import PACES, checked_pace
from core.twin.actions import Action, Repair, SetFault, SetTarget, tick_of
from core.twin.plan import PLAN_RANGES

BAR_ID = "live-bar"
ACTIONS_ID = "live-actions"
PAUSE_ID = "live-pause"
PACE_ID = "pace"
"""The choice in the form, before the flight."""

NO_PACE = "at once"

FIELDS: tuple[str, ...] = ("fault", "severity", "altitude_ft", "speed_kt")
"""The input fields of the bar, by the names that an `InputError` uses."""

BUTTONS: tuple[str, ...] = ("inject", "repair", "target")

NOW_S = 0.0
"""An action whose time is past happens now."""

_SHOWN = 8


def field_id(name: str) -> str:
    """Component id of a field of the bar."""
    return f"live-{name}"


def pace_id(pace: float) -> str:
    """Component id of the button that sets a pace."""
    return f"live-pace-{pace:g}"


def button_id(name: str) -> str:
    """Component id of a button of the bar."""
    return f"live-do-{name}"


def pace_choice() -> dmc.InputWrapper:
    """The choice of pace: as fast as possible, or live at a pace."""
    paces = [(f"{pace:g}", f"×{pace:g}") for pace in reversed(PACES) if math.isfinite(pace)]
    return dmc.InputWrapper(
        dmc.SegmentedControl(
            id=PACE_ID,
            data=[
                {"value": value, "label": label} for value, label in [(NO_PACE, "At once"), *paces]
            ],
            value=NO_PACE,
            fullWidth=True,
            size="xs",
            **attributes(aria_label="Pace"),
        ),
        label="Pace",
        labelElement="div",
        description="× is live: inject, repair, steer",
        size="xs",
    )


def read_pace(value: Any) -> float | None:
    """The pace chosen; None to fly at once. Raises `InputError`."""
    if value in (NO_PACE, None):
        return None
    try:
        return checked_pace(float(value))
    except (TypeError, ValueError):
        raise InputError("pace", "must be one of those offered") from None


def live_bar() -> html.Div:
    """The controls of a live flight; hidden until there is one."""
    paces = [
        html.Button(
            "Max" if math.isinf(pace) else f"×{pace:g}",
            id=pace_id(pace),
            type="button",
            className="live-button",
            **attributes(
                aria_pressed="false",
                aria_label="As fast as possible"
                if math.isinf(pace)
                else f"×{pace:g}, seconds of flight a second",
            ),
        )
        for pace in PACES
    ]
    return html.Div(
        [
            _group(
                "Pace",
                html.Button("Pause", id=PAUSE_ID, type="button", className="live-button wide"),
                html.Div(paces, className="live-paces", role="group",
                         **attributes(aria_label="Pace of the flight")),
            ),
            _group(
                "Engine",
                dmc.Select(
                    id=field_id("fault"), data=_fault_options(), value="engine_run_rough",
                    searchable=True, allowDeselect=False, size="xs", className="live-fault",
                    **attributes(aria_label="Fault to inject"),
                ),
                _number("severity", "Severity", 0.6, 0.1),
                _button("inject", "Inject",
                        "Inject this fault now, in place of any other; if it is active already, "
                        "change its severity"),
                _button("repair", "Repair", "Repair the engine now"),
            ),
            _group(
                "Pilot",
                _number("altitude_ft", "Altitude", None, 100),
                _number("speed_kt", "Speed", None, 5),
                _button("target", "Set", "Fly both aircraft to these targets"),
            ),
        ],
        id=BAR_ID,
        className="live-bar",
        hidden=True,
        role="region",
        **attributes(aria_label="Live flight"),
    )  # fmt: skip


def paced(pace: float, is_paused: bool) -> dict[tuple[str, str], Any]:
    """The bar at that pace: values by component and property."""
    pressed = {
        (pace_id(each), "aria-pressed"): "true" if each == pace else "false" for each in PACES
    }
    return {
        (BAR_ID, "hidden"): False,
        (PAUSE_ID, "children"): "Resume" if is_paused else "Pause",
        **pressed,
    }


def action_list(lines: Sequence[tuple[float, str]]) -> html.Ol | None:
    """The actions with their times, the latest first."""
    if not lines:
        return None
    listed = [
        html.Li([html.Span(clock(time_s), className="mono"), f" {words}"])
        for time_s, words in lines[: -_SHOWN - 1 : -1]
    ]
    if len(lines) > _SHOWN:
        listed.append(html.Li(f"and {len(lines) - _SHOWN} earlier", className="note"))
    return html.Ol(listed, className="live-actions", **attributes(aria_label="Actions"))


def read_action(button: str, values: Mapping[str, Any]) -> Action:
    """The action of a button, to happen now; raises `InputError` naming the field."""
    if button == button_id("repair"):
        return Repair(NOW_S)
    if button == button_id("inject"):
        if values["severity"] in ("", None):
            raise InputError("severity", "needs a value from 0 to 1")
        return SetFault(NOW_S, values["fault"], values["severity"])
    targets = {name: values[name] for name in ("altitude_ft", "speed_kt")}
    given = {name: value for name, value in targets.items() if value not in ("", None)}
    if not given:
        raise InputError("altitude_ft", "needs an altitude or a speed")
    return SetTarget(NOW_S, **given)


def action_lines(fault: Fault, actions: Iterable[Action]) -> list[tuple[float, str]]:
    """Time and words of each action, in the order of time; ``fault`` is that of the plan."""
    return list(_lines(fault, actions))


def _lines(fault: Fault, actions: Iterable[Action]) -> Iterator[tuple[float, str]]:
    mode = fault.mode
    for action in sorted(actions, key=tick_of):
        match action:
            case SetFault():
                name = catalogue()[action.mode].name
                again = mode == action.mode
                mode = action.mode
                yield (
                    action.time_s,
                    (
                        f"{name}: severity {action.severity:.2f}"
                        if again
                        else f"{name} injected, severity {action.severity:.2f}"
                    ),
                )
            case Repair():
                mode = "nominal"
                yield action.time_s, "Engine repaired"
            case SetTarget():
                yield action.time_s, f"New targets: {', '.join(_targets(action))}"


def _targets(action: SetTarget) -> Iterator[str]:
    if action.altitude_ft is not None:
        yield f"{action.altitude_ft:,.0f} ft"
    if action.speed_kt is not None:
        yield f"{action.speed_kt:.0f} kt"
    if action.heading_deg is not None:
        yield f"heading {action.heading_deg:03.0f}°"


def _group(title: str, *controls: Any) -> html.Div:
    return html.Div(
        [html.Span(title, className="live-title"), *controls],
        className="live-group",
        role="group",
        **attributes(aria_label=title),
    )


def _button(name: str, text: str, title: str) -> html.Button:
    return html.Button(
        text, id=button_id(name), type="button", className="live-button", title=title
    )


def _number(name: str, label: str, value: float | None, step: float) -> dmc.NumberInput:
    low, high, unit = PLAN_RANGES.get(name, (0.0, 1.0, ""))
    return dmc.NumberInput(
        id=field_id(name),
        value="" if value is None else value,
        placeholder=label,
        suffix=f" {unit_label(unit)}" if unit else "",
        step=step,
        # Never correct silently what was typed: the error names the range instead.
        clampBehavior="none",
        size="xs",
        className="live-number",
        **attributes(aria_label=f"{label}, {low:g} to {high:g} {unit}".rstrip(), data_unit=unit),
    )


def _fault_options() -> list[dict[str, Any]]:
    return [
        {"value": mode.id, "label": mode.name}
        for mode in catalogue().values()
        if mode.id != "nominal"
    ]
