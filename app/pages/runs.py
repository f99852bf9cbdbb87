"""The page *Runs*: what the store holds, newest first."""

from collections.abc import Sequence
from datetime import datetime

import dash_mantine_components as dmc
from dash import dcc, html

from app.pages.attributes import attributes
from app.pages.shell import run_path
from app.pages.words import STATUS_WORDS, mode_name, run_subtitle, run_title
from core.jobs.records import RunRecord

SHOWN = 200


def layout(records: Sequence[RunRecord]) -> html.Div:
    """The newest runs as a table; ``records`` are newest first."""
    if not records:
        return html.Div(
            [
                html.H1("No runs yet"),
                html.P(
                    ["Every flight is kept here. ", dcc.Link("Fly the first one", href="/"), "."]
                ),
            ],
            className="panel message-page",
        )
    shown = records[:SHOWN]
    count = f"{len(records)} runs" if len(records) > 1 else "1 run"
    more = f", the newest {SHOWN} shown" if len(records) > SHOWN else ""
    return html.Div(
        [
            html.Div([html.H1("Runs"), html.P(count + more, className="note")]),
            dmc.TableScrollContainer(
                dmc.Table(
                    [
                        dmc.TableThead(
                            dmc.TableTr(
                                [
                                    dmc.TableTh(head)
                                    for head in (
                                        "Flown (UTC)",
                                        "Fault",
                                        "Plan",
                                        "Diagnosis",
                                        "",
                                        "",
                                    )
                                ]
                            )
                        ),
                        dmc.TableTbody([_row(record) for record in shown]),
                    ],
                    highlightOnHover=True,
                    verticalSpacing=6,
                ),
                minWidth=720,
            ),
        ],
        className="panel runs-page",
    )


def _row(record: RunRecord) -> dmc.TableTr:
    verdict = "–"
    if record.top is not None and record.top_probability is not None:
        verdict = f"{mode_name(record.top)}, {100 * record.top_probability:.0f} %"
    created = datetime.fromisoformat(record.created)
    return dmc.TableTr(
        [
            dmc.TableTd(f"{created:%Y-%m-%d %H:%M:%S}", className="mono nowrap"),
            dmc.TableTd(dcc.Link(run_title(record), href=run_path(record.id))),
            dmc.TableTd(run_subtitle(record), className="note"),
            dmc.TableTd(verdict),
            dmc.TableTd(
                html.Span(
                    STATUS_WORDS[record.status],
                    className="badge",
                    **attributes(data_status=record.status),
                )
            ),
            dmc.TableTd(
                dcc.Link("Compare", href=f"/compare/{record.id}")
                if record.status == "done"
                else None
            ),
        ]
    )
