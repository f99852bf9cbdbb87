"""The pages *Results*: the paper's tables and figures, ours beside the paper's."""

from collections.abc import Mapping, Sequence
from datetime import datetime
from typing import Any

from dash import dcc, html

from app.figures.axes import GRAPH_CONFIG
from app.figures.scores import beside_paper
from app.kit.addresses import compare_path, fault_path, result_path
from app.kit.attributes import attributes
from app.kit.terms import term
from app.kit.words import mode_name
from app.pages.results.measures import EXPLAINED, MEASURES
from app.pages.results.model_card import card_line, model_parts, onset_note
from core.channels import unit_label
from core.experiments.headlines import WRITERS
from core.experiments.paper.published import paper_tables
from core.experiments.registry import EXPERIMENTS, Experiment
from core.experiments.stored import StoredResult, load_result, model_cards

Row = Mapping[str, Any]


def layout(name: str | None, sandbox_prefix: str = "") -> html.Div:
    """The overview, or one result of `EXPERIMENTS`.

    ``sandbox_prefix`` is that of the addresses open to a sandbox, in which figures come.
    """
    experiment = EXPERIMENTS[name] if name else None
    return html.Div(
        [
            html.Nav(_contents(name), className="panel results-nav", **attributes(
                aria_label="Results")),
            html.Div(
                _shown(experiment, sandbox_prefix) if experiment else _overview(),
                className="results-main",
            ),
        ],
        className="results-page",
    )  # fmt: skip


def _contents(name: str | None) -> html.Ul:
    entries = [("Overview", "/results", name is None)]
    entries += [(item.title, result_path(item.name), item.name == name)
                for item in EXPERIMENTS.values()]  # fmt: skip
    return html.Ul(
        [
            html.Li(
                html.Span(title, **attributes(aria_current="page"))
                if is_here
                else dcc.Link(title, href=path)
            )
            for title, path, is_here in entries
        ]
    )


def _overview() -> list[Any]:
    rows = [_overview_row(experiment) for experiment in EXPERIMENTS.values()]
    heads = ("Result", "Summary", term("lab", "Conditions"), "Created (UTC)")
    return [
        html.Section(
            [
                html.H1("Results"),
                html.P(
                    "The paper's tables and figures, reproduced by this code from seeds. Nothing "
                    "here is typed by hand: each line is read from the file that its command "
                    "wrote.",
                    className="note",
                ),
                html.Table(
                    [
                        html.Thead(html.Tr([html.Th(head, scope="col") for head in heads])),
                        html.Tbody(rows),
                    ],
                    className="plain overview",
                ),
            ],
            className="panel library-panel",
        )
    ]


def _overview_row(experiment: Experiment) -> html.Tr:
    if experiment.kind == "model":
        cards = model_cards()
        lines: list[Any] = [
            f"{card['conditions']}, {card['feature_mode']}: {card_line(card)}" for card in cards
        ] or [_not_made(experiment)]
        conditions = ", ".join(dict.fromkeys(card["conditions"] for card in cards)) or "–"
        made = "–"
    else:
        stored = [
            item for item in map(load_result, experiment.files) if item.content or item.problem
        ]
        lines = [_lined(experiment, item) for item in stored] or [_not_made(experiment)]
        conditions = ", ".join(dict.fromkeys(_conditions(item) for item in stored)) or "–"
        made = max((_made(item) for item in stored), default="–")
    return html.Tr(
        [
            html.Th(dcc.Link(experiment.title, href=result_path(experiment.name)), scope="row"),
            html.Td([html.Div(line) for line in lines]),
            html.Td(conditions, className="quiet" if conditions == "–" else None),
            html.Td(made, className="mono nowrap quiet" if made == "–" else "mono nowrap"),
        ]
    )


def _not_made(experiment: Experiment) -> html.Span:
    return html.Span(["not run yet: ", html.Code(experiment.command)], className="note")


def _lined(experiment: Experiment, stored: StoredResult) -> Any:
    """The headline of a result, after its conditions where there is one for each."""
    headline = _headline(experiment, stored)
    if len(experiment.files) < 2 or not isinstance(headline, str):
        return headline
    return f"{_conditions(stored)}: {headline}"


def _headline(experiment: Experiment, stored: StoredResult) -> Any:
    if stored.content is None:
        return html.Span(stored.problem, className="note")
    try:
        return experiment.headline(stored.content) or "available"
    except (KeyError, TypeError, IndexError):
        return html.Span("written by another version of this program", className="note")


def _conditions(stored: StoredResult) -> str:
    return str((stored.content or {}).get("settings", {}).get("conditions", "–"))


def _made(stored: StoredResult) -> str:
    stamp = (stored.content or {}).get("made_at")
    return f"{datetime.fromisoformat(stamp):%Y-%m-%d %H:%M}" if stamp else "–"


def _shown(experiment: Experiment, prefix: str) -> list[Any]:
    head = [html.H1(experiment.title), html.P(experiment.about, className="prose")]
    if experiment.kind == "model":
        parts = [part for card in model_cards() for part in model_parts(card)]
    else:
        parts = [
            part
            for stored in map(load_result, experiment.files)
            if stored.content or stored.problem
            for part in _result(experiment, stored, prefix)
        ]
    return [html.Section([*head, *(parts or _empty(experiment))], className="panel library-panel")]


def _empty(experiment: Experiment) -> list[Any]:
    """The command for a missing result; for a table, also the numbers of the paper."""
    content: list[Any] = [
        html.Div(
            [
                html.P("Not available on this installation yet. Run in a terminal:"),
                html.Pre(experiment.command),
                html.P(f"{experiment.duration} Then reload this page.", className="note"),
            ],
            className="empty",
        )
    ]
    reported = paper_tables().get(experiment.name, [])
    if reported:
        rows = [
            {"scheme": row["scheme"]}
            | {f"paper_{name}": value for name, value in row.items() if name != "scheme"}
            for row in reported
        ]
        content += [html.H2("What the paper reports"), _score_table(rows)]
    return content


def _result(experiment: Experiment, stored: StoredResult, prefix: str) -> list[Any]:
    if stored.content is None:
        return [html.P(stored.problem, className="empty")]
    try:
        body = (
            _scores(experiment, stored.content)
            if experiment.kind == "scores"
            else _picture(experiment, stored, prefix)
        )
    except (KeyError, TypeError, IndexError):
        body = [html.P(["This file was written by another version; run it again: ",
                        html.Code(experiment.command)], className="empty")]  # fmt: skip
    conditions = _conditions(stored)
    several = len(experiment.files) > 1
    title: list[Any] = [html.H2(f"{conditions.capitalize()} conditions")] if several else []
    if experiment.kind == "scores" and conditions == "field":
        title.append(html.P("The paper reports lab results only; there is nothing to compare with.",
                            className="note"))  # fmt: skip
        title += onset_note(stored.content)
    return [*title, *body, _origin(stored)]


def _scores(experiment: Experiment, content: Row) -> list[Any]:
    rows = [_flat(row) for row in content["rows"]]
    figure = beside_paper(rows, experiment.lead, MEASURES[experiment.lead][0], log=experiment.log)
    return [
        _said(experiment.headline(content)),
        dcc.Graph(
            figure=figure, config=GRAPH_CONFIG, responsive=True,
            style={"height": figure["layout"]["height"]},
        ),
        _score_table(rows),
    ]  # fmt: skip


def _said(headline: str) -> html.P:
    return html.P(f"{_capital(headline)}.", className="headline")


def _capital(text: str) -> str:
    """With a capital first; the others stay, for RPM and JSBSim."""
    return text[:1].upper() + text[1:]


def _flat(row: Row) -> dict[str, Any]:
    """A row with a ``scheme`` and ``paper_NAME`` beside each NAME; Table 6 nests both."""
    if "scheme" in row:
        return dict(row)
    kind = "grounded" if row["grounded"] else "raw"
    return (
        {name: value for name, value in row.items() if name in MEASURES}
        | {f"{name}_sd": value for name, value in row.get("sd", {}).items()}
        | {f"paper_{name}": value for name, value in row["paper"].items()}
        | {"scheme": f"{_capital(WRITERS.get(row['writer']) or row['writer'])}, {kind}"}
    )


def _score_table(rows: Sequence[Row]) -> html.Div:
    """Every measure, ours beside the paper's; a dash where there is none."""
    measures = [name for name in MEASURES if any(f"paper_{name}" in row for row in rows)]
    sides = (
        ("ours", "paper") if any(name in row for row in rows for name in measures) else ("paper",)
    )
    heads = [html.Th("", scope="col", rowSpan=2)]
    heads += [html.Th(_measure(name), scope="colgroup", colSpan=len(sides), className="pair")
              for name in measures]  # fmt: skip
    second = [
        html.Th(side, scope="col", className="number pair" if side == sides[0] else "number")
        for _ in measures
        for side in sides
    ]
    body = [
        html.Tr(
            [
                html.Th(row["scheme"], scope="row"),
                *(cell for name in measures for cell in _pair(row, name)[-len(sides) :]),
            ]
        )
        for row in rows
    ]
    return html.Div(
        html.Table(
            [html.Thead([html.Tr(heads), html.Tr(second)]), html.Tbody(body)],
            className="plain score-table",
        ),
        className="scroll-x",
        tabIndex=0,
        role="region",
        **attributes(aria_label="Scores, ours beside the paper's"),
    )


def _measure(name: str) -> str | html.Span:
    """The name of a measure, with its meaning where the glossary has it."""
    said = MEASURES[name][0]
    return term(EXPLAINED[name], said) if name in EXPLAINED else said


def _pair(row: Row, name: str) -> list[html.Td]:
    form = MEASURES[name][1]
    spread = row.get(f"{name}_sd")
    ours = _number(row.get(name), form)
    if spread is not None and row.get(name) is not None:
        ours += f" ± {spread:{form}}"
    return [
        html.Td(ours, className="number pair ours"),
        html.Td(_number(row.get(f"paper_{name}"), form), className="number theirs"),
    ]


def _number(value: float | None, form: str) -> str:
    return "–" if value is None else f"{value:{form}}"


def _picture(experiment: Experiment, stored: StoredResult, prefix: str) -> list[Any]:
    name = stored.name
    headline = experiment.headline(stored.content or {})
    parts: list[Any] = [_said(headline)] if headline else []
    if stored.picture:
        parts.append(
            html.Img(
                src=f"/results/files/{name}.png",
                alt=f"{experiment.title}. {experiment.about} {headline}",
                className="paper-figure",
            )
        )
    links: list[Any] = []
    if stored.page:
        links.append(
            html.A("Open the interactive figure", href=f"{prefix}/results/files/{name}.html",
                   target="_blank", rel="noopener")
        )  # fmt: skip
    if experiment.is_compared:
        links.append(dcc.Link("Fly these runs and compare them", href=compare_path([name])))
    if links:
        parts.append(html.P(links, className="link-row"))
    if name == "signs":
        parts += _disputes(stored.content or {})
    return parts


def _disputes(content: Row) -> list[Any]:
    """The signs and ranges that do not hold, with the likely reason."""
    failing = [
        row
        for row in content["rows"]
        if row["expected"] != "~" and not (row["held"] and row["within"])
    ]
    if not failing:
        return [html.P("Every sign and every range holds.")]
    severities = ", ".join(f"{float(each):g}" for each in failing[0]["deltas_by_severity"])
    heads = ("Fault", "Channel", "Expected", f"Twin at {severities}", "Why")
    return [
        html.H2("Not as expected"),
        html.Div(
            html.Table(
                [
                    html.Thead(html.Tr([html.Th(head, scope="col") for head in heads])),
                    html.Tbody([_dispute(row) for row in failing]),
                ],
                className="plain",
            ),
            className="scroll-x",
        ),
    ]


def _dispute(row: Row) -> html.Tr:
    found = ", ".join(f"{value:.1f}" for value in row["deltas_by_severity"].values())
    unit = unit_label(row["unit"])
    return html.Tr(
        [
            html.Th(dcc.Link(mode_name(row["fault"]), href=fault_path(row["fault"])), scope="row"),
            html.Td(row["channel"]),
            html.Td(f"{row['low']:g} to {row['high']:g} {unit}"),
            html.Td(f"{found} {unit}"),
            html.Td(row["disputed"] or "open"),
        ]
    )


def _origin(stored: StoredResult) -> html.P:
    """Where the numbers come from."""
    content = stored.content or {}
    made = content.get("provenance", {})
    settings = content.get("settings", {})
    quick = " A quick run, not the full experiment." if settings.get("quick") else ""
    return html.P(
        f"models/results/{stored.name}.json, created {_made(stored)} UTC with MirrorTwin "
        f"{made.get('mirrortwin', '?')} (commit {made.get('commit', '?')}, twin "
        f"{made.get('twin', '?')}).{quick}",
        className="note origin",
    )
