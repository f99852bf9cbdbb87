"""The page of a failure mode: mechanism, signature, look-alikes and actions."""

from collections.abc import Mapping, Sequence
from typing import Any

import dash_mantine_components as dmc
from dash import dcc, html

from app.figures.chain import chain_diagram
from app.figures.signature import expected_text, signed
from app.kit.addresses import fault_path, fly_path
from app.kit.attributes import attributes
from app.kit.terms import term
from app.kit.words import mode_name
from core.channels import channel
from core.cylinders import CYLINDERS
from core.experiments.signs.growth import GROWTH_SEVERITIES
from core.experiments.stored import StoredResult
from core.fmea.catalogue import Mode, catalogue
from core.knowledge.knowledge import SIGNS, ExpectedShift, ModeKnowledge, knowledge
from core.units import percent

SIGNATURE_ID = "signature"
SIGNS_COMMAND = "mirrortwin experiment signs"


def mode_layout(mode_id: str, signs: StoredResult) -> html.Div:
    """The page of one mode; ``signs`` is the sign matrix's result, if there is one."""
    mode, written = catalogue()[mode_id], knowledge()[mode_id]
    return html.Div(
        [
            _head(mode, written),
            html.Div(
                [
                    html.Div(
                        [
                            _section("Mechanism", html.P(written.mechanism, className="prose")),
                            _section(
                                "From defect to gauge",
                                chain_diagram(written.chain, mode.cylinder),
                            ),
                            _section(
                                "Signature, flown by the twin",
                                html.Div(
                                    html.P("Flying it at three severities…", className="note"),
                                    id=SIGNATURE_ID,
                                    **attributes(data_mode=mode_id, aria_live="polite"),
                                ),
                            ),
                        ],
                        className="fault-main",
                    ),
                    html.Div(
                        [
                            _section("Gauges", *_gauges(mode, written, signs)),
                            _section("Look-alikes", _look_alikes(written)),
                            _section("What to do", _actions(written)),
                            _section("On file", _file(mode, written)),
                        ],
                        className="fault-side",
                    ),
                ],
                className="fault-columns",
            ),
            dcc.Store(id="fault-mode", data=mode_id),
        ],
        className="fault-page",
    )


def _head(mode: Mode, written: ModeKnowledge) -> html.Div:
    place = "whole engine" if mode.whole_engine else f"usually cylinder {mode.cylinder}"
    where = mode.subsystem.capitalize() if mode.id != "nominal" else "Healthy"
    return html.Div(
        [
            html.Div(
                [
                    html.P(
                        [dcc.Link("Faults", href="/faults"), " / ", where],
                        className="note crumbs",
                    ),
                    html.H1(mode.name),
                    html.P(written.summary),
                    html.P(
                        f"Growth: {mode.law}; {place}."
                        if mode.id != "nominal"
                        else "Both aircraft fly the same flight.",
                        className="note",
                    ),
                ],
                className="fault-title",
            ),
            _ratings(mode) if mode.id != "nominal" else None,
            dcc.Link("Fly this", href=fly_path(mode.id), className="button-link", id="fly-this"),
        ],
        className="panel fault-head",
    )


def _ratings(mode: Mode) -> html.Dl:
    """The FMEA ratings, each on its scale of 1 to 10, and their product."""
    entries = [
        ("Severity", mode.severity_rating, "1 harmless, 10 hazardous without warning"),
        ("Occurrence", mode.occurrence, "1 almost never, 10 all the time"),
        ("Detection", mode.detection, "1 cannot be missed, 10 cannot be seen"),
    ]
    cells = [
        html.Div(
            [
                html.Dt(name),
                html.Dd(
                    [
                        html.B(str(value)),
                        html.Span(" of 10", className="note"),
                        dmc.Progress(
                            value=10 * value, size=4, color="gray", **attributes(aria_label=name)
                        ),
                    ]
                ),
            ],
            title=scale,
        )
        for name, value, scale in entries
    ]
    product = html.Div(
        [
            html.Dt(term("rpn")),
            html.Dd([html.B(str(mode.rpn)), html.Span(" of 1000", className="note")]),
        ]
    )
    return html.Dl([*cells, product], className="ratings")


def _section(title: str, *content: Any) -> html.Section:
    return html.Section(
        [html.H2(title, className="panel-title"), *content],
        className="panel",
        **attributes(aria_label=title),
    )


def _gauges(mode: Mode, written: ModeKnowledge, signs: StoredResult) -> list[Any]:
    """Expected shift of each gauge beside the shift in the twin; moving gauges first."""
    signature = written.signature(mode.cylinder)
    found = _found(mode.id, signs)
    order = sorted(signature, key=lambda name: SIGNS.index(signature[name].sign) // 2 % 2)
    moving = [name for name in order if signature[name].sign != "0"]
    still = [channel(name).label for name in order if signature[name].sign == "0"]
    content: list[Any] = []
    if moving:
        content.append(_gauge_table(moving, signature, found))
    if still:
        content.append(html.P(f"Steady: {', '.join(still)}.", className="note gauges-still"))
    if found:
        content.append(html.P(_how_found(mode, signs), className="note"))
    elif moving:
        content.append(
            html.P(
                ["The twin's shifts appear here after ", html.Code(SIGNS_COMMAND), "."],
                className="note",
            )
        )
    return content


def _gauge_table(
    names: Sequence[str],
    signature: Mapping[str, ExpectedShift],
    found: Mapping[str, Mapping[str, Any]],
) -> dmc.TableScrollContainer:
    severities = list(next(iter(found.values()))["deltas_by_severity"]) if found else []
    heads: list[Any] = [html.Th("Gauge", scope="col"), html.Th("Expected", scope="col")]
    heads += [html.Th(f"Twin {each}", scope="col", className="number") for each in severities]
    rows = []
    for name in names:
        expected = signature[name]
        deltas = found.get(name, {}).get("deltas_by_severity", {})
        rows.append(
            html.Tr(
                [
                    html.Th(channel(name).label, scope="row"),
                    html.Td(
                        f"~ {expected_text(expected, name)}"
                        if expected.sign == "~"
                        else expected_text(expected, name)
                    ),
                    *(
                        html.Td(_delta(deltas.get(each), name), className="number")
                        for each in severities
                    ),
                ]
            )
        )
    return dmc.TableScrollContainer(
        html.Table([html.Thead(html.Tr(heads)), html.Tbody(rows)], className="plain"), minWidth=0
    )


def _delta(value: float | None, name: str) -> str:
    if value is None:
        return "–"
    return signed(round(value, max(1, channel(name).decimals)))


def _found(mode: str, signs: StoredResult) -> dict[str, Mapping[str, Any]]:
    """The rows of the sign matrix for a mode, by channel."""
    rows = signs.content.get("rows", []) if signs.content else []
    return {row["channel"]: row for row in rows if row["fault"] == mode}


def _how_found(mode: Mode, signs: StoredResult) -> str:
    flights = len((signs.content or {})["settings"]["plans"])
    where = "" if mode.whole_engine else f" on cylinder {mode.cylinder}"
    return f"Twin: mean shift of {flights} flights by severity, lab conditions{where}."


def _look_alikes(written: ModeKnowledge) -> html.Ul:
    return html.Ul(
        [
            html.Li(
                [
                    dcc.Link(mode_name(item.mode), href=fault_path(item.mode)),
                    html.P(item.tell),
                ]
            )
            for item in written.look_alikes
        ],
        className="look-alikes",
    )


def _actions(written: ModeKnowledge) -> html.Ol:
    return html.Ol([html.Li(action) for action in written.actions], className="actions")


def _file(mode: Mode, written: ModeKnowledge) -> html.Dl:
    entries: list[tuple[str, Any]] = [("ATA chapter", written.ata), ("Records", written.records)]
    if not mode.whole_engine:
        shares = ", ".join(
            f"{cylinder}: {percent(share)}"
            for cylinder, share in zip(CYLINDERS, written.cylinder_share, strict=True)
        )
        entries.append(("By cylinder", shares))
    entries.append(("In JSBSim", [mode.jsbsim_because, *_carriers(mode)]))
    return html.Dl([item for name, text in entries for item in (html.Dt(name), html.Dd(text))],
                   className="facts")  # fmt: skip


def _carriers(mode: Mode) -> list[Any]:
    return [html.Code(name) for name in mode.jsbsim]


def flown_words() -> str:
    """The caption of the signature's charts."""
    severities = ", ".join(f"{severity:g}" for severity in GROWTH_SEVERITIES)
    return f"Faulted minus mirror at severity {severities}; onset at 1:00."
