"""The form of a flight and its fault, and reading it."""

from collections.abc import Mapping
from dataclasses import asdict, fields
from typing import Any

import dash_mantine_components as dmc
from dash import html

from app.kit.attributes import attributes
from app.kit.terms import term
from app.pages.fly.live_controls import pace_choice
from core.channels import unit_label
from core.cylinders import CYLINDERS
from core.errors import InputError
from core.fmea.catalogue import catalogue
from core.fmea.fault import Fault
from core.twin.plan import PLAN_RANGES, Plan, Weather

DEFAULT_PLAN = Plan(seed=7)
DEFAULT_FAULT = Fault("cylinder_compression", severity=0.8, onset_s=60.0)

AUTO_CYLINDER = "auto"

WEATHER_FIELDS: tuple[str, ...] = tuple(field.name for field in fields(Weather))

FIELDS: tuple[str, ...] = (
    "altitude_ft",
    "speed_kt",
    "heading_deg",
    "duration_s",
    "seed",
    "power",
    "conditions",
    *WEATHER_FIELDS,
    "fault",
    "severity",
    "onset_s",
    "cylinder",
)
"""Every field of the form, under the name that an `InputError` gives it."""

_WRAPPED = ("power", "conditions", "severity", "cylinder")
"""Controls that cannot show an error themselves; a wrapper around them does."""


def field_id(name: str) -> str:
    """Component id of the control of a field."""
    return f"field-{name}"


def error_id(name: str) -> str:
    """Component id of what shows the error of a field, by its ``error`` property."""
    return f"wrap-{name}" if name in _WRAPPED else field_id(name)


def form_values(plan: Plan, fault: Fault) -> dict[str, Any]:
    """The value of every control for a plan and a fault."""
    return {
        "altitude_ft": plan.altitude_ft,
        "speed_kt": plan.speed_kt,
        "heading_deg": plan.heading_deg,
        "duration_s": plan.duration_s,
        "seed": plan.seed,
        "power": plan.power,
        "conditions": plan.conditions,
        **asdict(plan.weather),
        "fault": fault.mode,
        "severity": fault.severity,
        "onset_s": fault.onset_s,
        "cylinder": str(fault.cylinder or AUTO_CYLINDER),
    }


def read_form(values: Mapping[str, Any]) -> tuple[Plan, Fault]:
    """The plan and the fault that the controls describe; raises `InputError` naming the field."""
    for name in FIELDS:
        if values[name] in ("", None):
            raise InputError(name, f"needs a value{_range_words(name)}")
    plan = Plan(
        altitude_ft=values["altitude_ft"],
        speed_kt=values["speed_kt"],
        heading_deg=values["heading_deg"],
        duration_s=values["duration_s"],
        seed=values["seed"],
        power=values["power"],
        conditions=values["conditions"],
        weather=Weather(**{name: values[name] for name in WEATHER_FIELDS}),
    )
    cylinder = values["cylinder"]
    fault = Fault(
        mode=values["fault"],
        severity=values["severity"],
        onset_s=values["onset_s"],
        cylinder=None if cylinder == AUTO_CYLINDER else _whole_number("cylinder", cylinder),
    )
    fault.check_within(plan.duration_s)
    return plan, fault


def fault_note(mode: str) -> str:
    """One line under the fault: where it sits and how it grows."""
    entry = catalogue().get(mode)
    if entry is None:
        return ""
    if mode == "nominal":
        return "No fault: both aircraft fly the same flight."
    place = "whole engine" if entry.whole_engine else f"usually cylinder {entry.cylinder}"
    return f"Growth: {entry.law}; {place}."


def setup_panel(fault: Fault = DEFAULT_FAULT) -> html.Div:
    """The whole form with its defaults, that fault and its buttons."""
    values = form_values(DEFAULT_PLAN, fault)
    return html.Div(
        [
            html.Section(
                [
                    html.H2("Flight plan", className="panel-title"),
                    html.Div(_plan_fields(values), className="field-grid"),
                    html.Details(
                        [
                            html.Summary("Weather"),
                            html.Div(_weather_fields(values), className="field-grid"),
                        ],
                        id="weather",
                    ),
                ]
            ),
            html.Section(
                [
                    html.H2("Fault", className="panel-title"),
                    html.Div(_fault_fields(values), className="field-stack"),
                ]
            ),
            _run_buttons(),
        ],
        id="setup",
        className="panel setup",
        role="form",
        **attributes(aria_label="Flight and fault"),
    )


def _plan_fields(values: Mapping[str, Any]) -> list[Any]:
    return [
        _number("altitude_ft", "Altitude", values, step=100),
        _number("speed_kt", "Speed (IAS)", values, step=1),
        _number("heading_deg", "Heading", values, step=5),
        _number("duration_s", "Duration", values, step=30),
        dmc.NumberInput(
            id=field_id("seed"),
            label=term("seed"),
            description="whole number",
            value=values["seed"],
            step=1,
            allowDecimal=False,
            clampBehavior="none",
            size="xs",
            **attributes(data_whole="yes"),
        ),
        _choice(
            "conditions",
            term("lab", "Conditions"),
            [("lab", "Lab"), ("field", "Field")],
            values,
            description="shared noise / real",
        ),
        html.Div(
            _choice(
                "power",
                "Throttle",
                [("fixed", "Fixed"), ("speed_hold", "Speed hold")],
                values,
            ),
            className="span-2",
        ),
    ]


def _weather_fields(values: Mapping[str, Any]) -> list[Any]:
    return [
        _number("isa_deviation_degc", "ISA deviation", values, step=1),
        _number("turbulence", "Turbulence", values, step=1),
        _number("wind_kt", "Wind", values, step=1),
        _number("wind_from_deg", "Wind from", values, step=10),
    ]


def _fault_fields(values: Mapping[str, Any]) -> list[Any]:
    return [
        dmc.Select(
            id=field_id("fault"),
            label="Failure mode",
            data=_fault_options(),
            value=values["fault"],
            searchable=True,
            allowDeselect=False,
            nothingFoundMessage="No such mode",
            maxDropdownHeight=360,
            size="xs",
        ),
        html.P(fault_note(values["fault"]), id="fault-note", className="note"),
        _severity_field(values),
        html.Div(
            [
                _number(
                    "onset_s",
                    term("onset"),
                    values,
                    step=5,
                    limits=(0.0, PLAN_RANGES["duration_s"][1], "s"),
                ),
                _choice(
                    "cylinder",
                    "Cylinder",
                    [(AUTO_CYLINDER, "Auto"), *((str(n), str(n)) for n in CYLINDERS)],
                    values,
                    description="auto: the usual one",
                ),
            ],
            className="field-grid onset-row",
        ),
    ]


def _severity_field(values: Mapping[str, Any]) -> dmc.InputWrapper:
    return dmc.InputWrapper(
        dmc.Slider(
            id=field_id("severity"),
            value=values["severity"],
            min=0,
            max=1,
            step=0.05,
            precision=2,
            size="sm",
            thumbLabel="Severity, 0 to 1",
            marks=[{"value": v, "label": f"{v:g}"} for v in (0, 0.5, 1)],
            updatemode="drag",
        ),
        id=error_id("severity"),
        label=[term("severity"), " ", html.Output("", id="severity-value", className="mono")],
        size="xs",
        className="severity",
    )


def _run_buttons() -> html.Div:
    return html.Div(
        [
            pace_choice(),
            dmc.Button(
                "Run",
                id="run",
                fullWidth=True,
                size="sm",
                n_clicks=0,
                # Words: a spinner costs a browser without a GPU half a core, when it needs it most.
                loaderProps={"children": "Starting…"},
                buttonProps={"title": "Fly it (Ctrl+Enter)", "aria-keyshortcuts": "Control+Enter"},
            ),
            html.P([dmc.Kbd("Ctrl", size="xs"), " + ", dmc.Kbd("Enter", size="xs"), " runs"],
                   className="note centred"),
        ],
        className="run-buttons",
    )  # fmt: skip


def _number(
    name: str,
    label: Any,
    values: Mapping[str, Any],
    *,
    step: float,
    limits: tuple[float, float, str] | None = None,
) -> dmc.NumberInput:
    low, high, unit = limits or PLAN_RANGES[name]
    suffix = "°" if unit == "deg" else f" {unit_label(unit)}"
    return dmc.NumberInput(
        id=field_id(name),
        label=label,
        description=f"{low:,.0f} to {high:,.0f}{suffix}".replace("-", "−"),
        value=values[name],
        step=step,
        suffix=suffix,
        # Never correct silently what was typed: the error names the range instead.
        clampBehavior="none",
        size="xs",
        **attributes(data_unit=suffix.strip()),
    )


def _choice(
    name: str,
    label: Any,
    options: list[tuple[str, str]],
    values: Mapping[str, Any],
    description: str | None = None,
) -> dmc.InputWrapper:
    return dmc.InputWrapper(
        dmc.SegmentedControl(
            id=field_id(name),
            data=[{"value": value, "label": text} for value, text in options],
            value=values[name],
            fullWidth=True,
            size="xs",
        ),
        id=error_id(name),
        label=label,
        labelElement="div",
        description=description,
        size="xs",
    )


def _fault_options() -> list[dict[str, Any]]:
    """The modes grouped by subsystem, in catalogue order."""
    groups: dict[str, list[dict[str, str]]] = {}
    for mode in catalogue().values():
        group = "Healthy" if mode.id == "nominal" else mode.subsystem.capitalize()
        groups.setdefault(group, []).append({"value": mode.id, "label": mode.name})
    return [{"group": group, "items": items} for group, items in groups.items()]


def _range_words(name: str) -> str:
    limits = PLAN_RANGES.get(name)
    return f" from {limits[0]:g} to {limits[1]:g} {limits[2]}" if limits else ""


def _whole_number(name: str, value: Any) -> int:
    try:
        return int(value)
    except (TypeError, ValueError):
        raise InputError(name, f"must be auto, 1, 2, 3 or 4, got {value!r}") from None
