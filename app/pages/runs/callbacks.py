"""The callbacks of the page *Runs*: labelling runs, deleting and restoring them."""

import asyncio
from collections.abc import Sequence
from contextlib import suppress
from typing import Any

from dash import Dash, Input, Output, State, html, no_update
from dash.exceptions import PreventUpdate

from app.kit.wiring import in_browser
from app.pages.runs import page as runs
from core.errors import InputError, MirrorTwinError, StoreError
from core.store.labels import (
    Label,
    discard,
    discarded,
    empty,
    label_of,
    labels,
    read_tags,
    restore,
    write_label,
)
from core.store.records import valid_run_id
from core.store.store import RunStore

VISIBLE: dict[str, str] = {}
HIDDEN = {"display": "none"}


def current_layout(store: RunStore, imported: int = 0) -> html.Div:
    """The page as the store stands; runs deleted a day ago are removed from the disk."""
    with suppress(StoreError):  # a folder that cannot be written to
        empty(store)
    return runs.layout(store.records(), labels(store), discarded(store), imported)


def register(app: Dash, store: RunStore) -> None:
    """Attach the callbacks of the page to ``app``."""
    _register_selection(app)
    _register_writing(app, store)
    _register_delete(app, store)
    _register_undo(app, store)
    _register_import(app, store)
    _register_progress(app, store)


def _register_selection(app: Dash) -> None:
    """Attach what the browser does alone: the search, and the actions for the chosen runs."""
    in_browser(
        app,
        "runs",
        "search",
        Output(runs.GRID_ID, "dashGridOptions"),
        Input(runs.SEARCH_ID, "value"),
        State(runs.GRID_ID, "dashGridOptions"),
        on_load=False,
    )
    in_browser(
        app, "runs", "chosen",
        Output(runs.CHOSEN_ID, "data"),
        Output(runs.HIDDEN_ID, "children"),
        *(Output(item, prop) for item in (runs.COMPARE_ID, runs.EXPORT_ID, runs.DELETE_ID)
          for prop in ("children", "disabled")),
        *(Output(item, prop) for item in (runs.ZIP_ID, runs.FAULTED_ID, runs.MIRROR_ID)
          for prop in ("href", "disabled")),
        Input(runs.GRID_ID, "selectedRows"),
        Input(runs.GRID_ID, "virtualRowData"),
    )  # fmt: skip
    in_browser(
        app,
        "runs",
        "compare",
        Output("url", "pathname", allow_duplicate=True),
        Input(runs.COMPARE_ID, "n_clicks"),
        State(runs.CHOSEN_ID, "data"),
        on_load=False,
    )


def _register_writing(app: Dash, store: RunStore) -> None:
    @app.callback(
        Output(runs.GRID_ID, "rowTransaction"),
        Output(runs.PROBLEM_ID, "children"),
        Input(runs.GRID_ID, "cellValueChanged"),
        websocket=True,
        prevent_initial_call=True,
    )
    async def write(changes: list[dict[str, Any]] | None) -> tuple[Any, str]:
        """Store the edited cells; the grid then shows what is stored."""
        rows, problem = [], ""
        for change in changes or []:
            run_id, column, text = change["rowId"], change["colId"], change.get("value") or ""
            try:
                rows.append(await asyncio.to_thread(_write_cell, store, run_id, column, str(text)))
            except MirrorTwinError as error:
                problem = _problem(error)
                rows += await asyncio.to_thread(_rows, store, [run_id])
        return {"update": rows}, problem


def _write_cell(store: RunStore, run_id: str, column: str, text: str) -> runs.Row:
    """Write one cell; returns the row as it then is. Raises `InputError` or `StoreError`."""
    was = label_of(store, run_id)
    match column:
        case "tags":
            label = Label(read_tags(text), was.note)
        case "note":
            label = Label(was.tags, text.replace("\r\n", "\n").strip())
        case _:
            raise InputError(column[:40], "cannot be changed")
    write_label(store, run_id, label)
    return runs.row_of(store.get(run_id), label)


def _rows(store: RunStore, run_ids: Sequence[str]) -> list[runs.Row]:
    """The rows of those runs that there are."""
    written = labels(store)
    found = []
    for run_id in run_ids:
        try:
            found.append(runs.row_of(store.get(run_id), written.get(run_id, Label())))
        except StoreError:
            continue
    return found


_ON_DELETION = (
    Output(runs.GRID_ID, "rowTransaction", allow_duplicate=True),
    Output(runs.NOTICE_ID, "children", allow_duplicate=True),
    Output(runs.GONE_ID, "data", allow_duplicate=True),
    Output(runs.UNDO_ID, "style", allow_duplicate=True),
    Output(runs.PROBLEM_ID, "children", allow_duplicate=True),
)
"""What a deletion changes, and its undoing: rows, notice, deleted runs, Undo, problem."""


def _register_delete(app: Dash, store: RunStore) -> None:
    @app.callback(
        *_ON_DELETION,
        Output(runs.GRID_ID, "selectedRows"),
        Input(runs.DELETE_ID, "n_clicks"),
        State(runs.CHOSEN_ID, "data"),
        websocket=True,
        prevent_initial_call=True,
    )
    async def delete(clicks: int | None, chosen: list[str] | None) -> tuple[Any, ...]:
        """Delete the chosen runs; for a day they can be restored."""
        run_ids = [run_id for run_id in chosen or [] if valid_run_id(run_id)]
        if not clicks or not run_ids:
            raise PreventUpdate
        try:
            kept = await asyncio.to_thread(discard, store, run_ids)
        except MirrorTwinError as error:
            return no_update, no_update, no_update, no_update, _problem(error), no_update
        gone = [{"id": run_id} for run_id in run_ids]
        words = runs.gone_words(len(run_ids), is_final=not kept)
        return {"remove": gone}, words, kept, VISIBLE if kept else HIDDEN, "", []


def _register_undo(app: Dash, store: RunStore) -> None:
    @app.callback(
        *_ON_DELETION,
        Input(runs.UNDO_ID, "n_clicks"),
        State(runs.GONE_ID, "data"),
        websocket=True,
        prevent_initial_call=True,
    )
    async def undo(clicks: int | None, gone: list[str] | None) -> tuple[Any, ...]:
        """Restore what was deleted last."""
        if not clicks or not gone:
            raise PreventUpdate
        try:
            back = await asyncio.to_thread(restore, store, gone)
            rows = await asyncio.to_thread(_rows, store, back)
        except MirrorTwinError as error:
            return no_update, no_update, no_update, no_update, _problem(error)
        words = f"{len(back)} run{'s' if len(back) != 1 else ''} restored."
        return {"add": rows}, words, [], HIDDEN, ""


def _register_import(app: Dash, store: RunStore) -> None:
    @app.callback(
        Output("page", "children", allow_duplicate=True),
        Output(runs.PROBLEM_ID, "children", allow_duplicate=True),
        Output(runs.NOTICE_ID, "children", allow_duplicate=True),
        Input(runs.IMPORTED_ID, "data"),
        websocket=True,
        prevent_initial_call=True,
    )
    async def arrived(outcome: dict[str, Any] | None) -> tuple[Any, ...]:
        """Show the outcome of an upload, which `files` has answered."""
        if not outcome:
            raise PreventUpdate
        if problem := outcome.get("problem"):
            return no_update, str(problem)[:500], ""
        layout = await asyncio.to_thread(current_layout, store, len(outcome["imported"]))
        return layout, no_update, no_update


def _register_progress(app: Dash, store: RunStore) -> None:
    @app.callback(
        Output(runs.GRID_ID, "rowTransaction", allow_duplicate=True),
        Output(runs.CLOCK_ID, "disabled"),
        Output("runs-flying", "data"),
        Input(runs.CLOCK_ID, "n_intervals"),
        State("runs-flying", "data"),
        websocket=True,
        prevent_initial_call=True,
    )
    async def follow(ticks: int | None, flying: list[str]) -> tuple[Any, bool, list[str]]:
        """Update the rows of unfinished runs until all are finished."""
        if not ticks:
            raise PreventUpdate
        asked = [run_id for run_id in flying if valid_run_id(run_id)]
        rows = await asyncio.to_thread(_rows, store, asked)
        left = [row["id"] for row in rows if row["status"] in ("queued", "running")]
        return {"update": rows}, not left, left


def _problem(error: MirrorTwinError) -> str:
    """An error as a sentence on the page."""
    return f"Not done: {error}"
