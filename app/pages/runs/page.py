"""The page *Runs*: every stored run, to find, label, compare, export and delete.

Tags and notes go into cells as text: the grid's renderers in ``runs/runs.js`` turn them into
elements and never into markup.
"""

from collections.abc import Mapping, Sequence
from datetime import datetime
from typing import Any

import dash_ag_grid as dag
import dash_mantine_components as dmc
from dash import dcc, html

from app.kit.attributes import attributes
from app.kit.words import STATUS_WORDS, flown_fault, mode_name
from core.store.labels import MAX_NOTE, Label
from core.store.outcome import run_outcome
from core.store.records import RunRecord

GRID_ID, SEARCH_ID, COUNT_ID, NOTICE_ID, PROBLEM_ID, UNDO_ID, GONE_ID, CLOCK_ID = (
    "runs-grid", "runs-search", "runs-count", "runs-notice", "runs-problem", "runs-undo",
    "runs-gone", "runs-clock",
)  # fmt: skip
CHOSEN_ID, HIDDEN_ID = "runs-chosen", "runs-hidden"
COMPARE_ID, EXPORT_ID, ZIP_ID, FAULTED_ID, MIRROR_ID, DELETE_ID, IMPORT_ID, IMPORTED_ID = (
    "runs-compare", "runs-export", "runs-zip", "runs-csv-faulted", "runs-csv-mirror",
    "runs-delete", "runs-import", "runs-imported",
)  # fmt: skip

MAX_ROWS = 5000
"""Number of runs in the grid, the newest: some 2 MB."""

ROWS_POLL_MS = 2000

Row = dict[str, Any]


def layout(
    records: Sequence[RunRecord],
    labels: Mapping[str, Label],
    gone: Sequence[str],
    imported: int = 0,
) -> html.Div:
    """All runs, ``records`` newest first, with their labels.

    ``gone``: deleted runs that can still be restored. ``imported``: the number of runs imported
    just now.
    """
    rows = [row_of(record, labels.get(record.id, Label())) for record in records[:MAX_ROWS]]
    flying = [record.id for record in records if not record.finished]
    more = f"the newest {MAX_ROWS:,} of {len(records):,}" if len(records) > MAX_ROWS else ""
    return html.Div(
        [
            html.Div(
                [
                    html.Div([html.H1("Runs"), html.Span(more, id=COUNT_ID, className="note")],
                             className="runs-title"),
                    dmc.TextInput(
                        id=SEARCH_ID, placeholder="Search faults, tags, notes…", size="xs",
                        className="runs-search", **attributes(aria_label="Search runs"),
                    ),
                    html.Span("", id=HIDDEN_ID, className="note", role="status"),
                    html.Div(_actions(), className="runs-actions", role="toolbar",
                             **attributes(aria_label="With the selected runs")),
                ],
                className="runs-head",
            ),
            _notice(gone, imported),
            html.P("", id=PROBLEM_ID, className="runs-problem", role="alert"),
            _grid(rows) if rows or gone else _empty(),
            dcc.Store(id=CHOSEN_ID, data=[]),
            dcc.Store(id=IMPORTED_ID, data=None),
            dcc.Store(id="runs-flying", data=flying),
            dcc.Interval(id=CLOCK_ID, interval=ROWS_POLL_MS, disabled=not flying),
        ],
        className="panel runs-page",
    )  # fmt: skip


def row_of(record: RunRecord, label: Label) -> Row:
    """A run as a row: numbers as numbers, so that they sort and filter as such."""
    plan, fault = record.plan, flown_fault(record)
    is_broken = fault.mode != "nominal"
    outcome = run_outcome(record)
    return {
        "id": record.id,
        "fault": mode_name(fault.mode),
        "severity": fault.severity if is_broken else None,
        "onset_s": fault.onset_s if is_broken else None,
        "diagnosis": mode_name(record.top) if record.top else "",
        "share": record.top_probability,
        "right": None if outcome is None else outcome.right,
        "status": record.status,
        "status_words": STATUS_WORDS[record.status],
        "tags": ", ".join(label.tags),
        "note": label.note,
        "altitude_ft": plan.altitude_ft,
        "speed_kt": plan.speed_kt,
        "duration_s": plan.duration_s,
        "conditions": plan.conditions,
        "seed": plan.seed,
        "created": f"{datetime.fromisoformat(record.created):%Y-%m-%d %H:%M:%S}",
    }


def _actions() -> list[Any]:
    def item(item_id: str, label: str, about: str) -> dmc.MenuItem:
        return dmc.MenuItem([label, html.Div(about, className="note")], id=item_id, href="#",
                            refresh=True, disabled=True)  # fmt: skip

    return [
        dmc.Button("Compare", id=COMPARE_ID, size="xs", disabled=True),
        dmc.Menu(
            [
                dmc.MenuTarget(
                    dmc.Button("Export", id=EXPORT_ID, size="xs", variant="default", disabled=True)
                ),
                dmc.MenuDropdown(
                    [
                        item(ZIP_ID, "Everything, as a zip",
                             "Parquet, Rerun recording, report; can be imported again"),
                        item(FAULTED_ID, "Faulted flight, as a G1000 log",
                             "CSV, one row a second, for G1000 log viewers"),
                        item(MIRROR_ID, "Mirror flight, as a G1000 log",
                             "The same flight without the fault"),
                    ]
                ),
            ],
            position="bottom-end",
        ),
        dmc.Button("Delete", id=DELETE_ID, size="xs", variant="default", disabled=True),
        dmc.Button("Import…", id=IMPORT_ID, size="xs", variant="default"),
    ]  # fmt: skip


def _notice(gone: Sequence[str], imported: int) -> html.Div:
    """What was done last, with Undo for as long as deleted runs can be restored."""
    words = [f"{imported} run{'s' if imported > 1 else ''} imported."] if imported else []
    words += [gone_words(len(gone))] if gone else []
    return html.Div(
        [
            html.Span(" ".join(words), id=NOTICE_ID),
            dmc.Button("Undo", id=UNDO_ID, size="compact-sm", variant="default",
                       style={} if gone else {"display": "none"}),
            dcc.Store(id=GONE_ID, data=list(gone)),
        ],
        className="runs-notice",
        role="status",
    )  # fmt: skip


def gone_words(n: int, *, is_final: bool = False) -> str:
    """The notice after a deletion, and whether it can be undone.

    >>> gone_words(1)
    '1 run deleted. You can undo this for 24 hours, or until the disk is full.'
    >>> gone_words(2, is_final=True)
    '2 runs deleted permanently: the disk was full.'
    """
    what = f"{n} runs" if n > 1 else "1 run"
    if is_final:
        return f"{what} deleted permanently: the disk was full."
    return f"{what} deleted. You can undo this for 24 hours, or until the disk is full."


def _empty() -> html.Div:
    return html.Div(
        [
            html.P("Every flight is kept here, with its diagnosis and your notes."),
            html.P([dcc.Link("Fly the first one", href="/"), ", or import one that a colleague "
                    "exported."]),
        ],
        className="empty",
    )  # fmt: skip


def _grid(rows: list[Row]) -> dag.AgGrid:
    return dag.AgGrid(
        id=GRID_ID,
        rowData=rows,
        columnDefs=_columns(),
        defaultColDef={
            "sortable": True, "resizable": True, "filter": True, "suppressMovable": False,
            "minWidth": 84,
        },
        getRowId="params.data.id",
        dashGridOptions={
            "rowSelection": {"mode": "multiRow", "selectAll": "filtered"},
            "selectionColumnDef": {"pinned": None, "width": 44, "maxWidth": 44},
            "rowHeight": 34,
            "headerHeight": 34,
            "animateRows": False,
            "stopEditingWhenCellsLoseFocus": True,
            "localeText": {"noRowsToShow": "No run to show", "noMatchingRows": "No run matches"},
            "suppressCellFocus": False,
            "enableCellTextSelection": True,
            "tooltipShowDelay": 400,
        },
        dangerously_allow_code=False,
        className="runs-grid",
        style={"height": "max(320px, calc(100vh - 140px))"},
    )  # fmt: skip


def _columns() -> list[dict[str, Any]]:
    def number(field: str, head: str, width: int, form: str) -> dict[str, Any]:
        return {
            "field": field, "headerName": head, "width": width, "filter": "agNumberColumnFilter",
            "type": "rightAligned", "valueFormatter": {"function": form},
        }  # fmt: skip

    def written(field: str, head: str, width: int, **more: Any) -> dict[str, Any]:
        return {
            "field": field, "headerName": head, "width": width, "flex": 1, "editable": True,
            "headerTooltip": "Double-click or press Enter to edit", **more,
        }  # fmt: skip

    return [
        {"field": "fault", "headerName": "Fault", "minWidth": 200, "flex": 1.2,
         "cellRenderer": "RunLink"},
        {"field": "diagnosis", "headerName": "Diagnosis", "minWidth": 245, "flex": 1.4,
         "cellRenderer": "RunVerdict"},
        number("severity", "Severity", 100, "runFixed(params.value, 2)"),
        {"field": "status_words", "headerName": "State", "width": 96, "cellRenderer": "RunBadge"},
        {"field": "created", "headerName": "Flown (UTC)", "width": 150, "sort": "desc",
         "valueFormatter": {"function": "runMinute(params.value)"}},
        written("tags", "Tags", 150, cellRenderer="RunTags", minWidth=90),
        written("note", "Note", 200, tooltipField="note", minWidth=100,
                cellEditor="agLargeTextCellEditor", cellEditorPopup=True,
                cellEditorParams={"maxLength": MAX_NOTE, "rows": 6, "cols": 44}),
        number("onset_s", "Onset", 84, "runClock(params.value)"),
        number("altitude_ft", "Altitude, ft", 108, "runFixed(params.value, 0)"),
        number("duration_s", "Length", 88, "runClock(params.value)"),
        number("seed", "Seed", 92, "params.value"),
        number("speed_kt", "Speed, kt", 100, "runFixed(params.value, 0)"),
        {"field": "conditions", "headerName": "Conditions", "width": 110},
    ]  # fmt: skip
