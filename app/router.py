"""The wiring: what a click, a keystroke or an address sets in motion."""

import asyncio
import logging
from dataclasses import replace
from typing import Any

from dash import Dash, Input, Output, State, ctx, html, no_update

from app.kit.wiring import in_browser, show_error
from app.kit.words import sentence
from app.pages.faults import callbacks as library
from app.pages.faults import mode_page as fault_page
from app.pages.faults import page as faults
from app.pages.fly import callbacks as fly_callbacks
from app.pages.fly import cursor_tools, live_callbacks, playback, present
from app.pages.fly import page as fly
from app.pages.fly.session import UNEXPECTED, Page
from app.pages.fly.setup import DEFAULT_FAULT
from app.pages.help import missing, tour
from app.pages.help import page as help
from app.pages.report import callbacks as report_callbacks
from app.pages.report import panel as report_panel
from app.pages.runs import callbacks as runs_callbacks
from app.pages.teach import callbacks as teach_callbacks
from app.services import Services
from app.shell import Address, read_address
from core.errors import StoreError
from core.experiments.stored import take

logger = logging.getLogger(__name__)

NO_SOCKET = (
    "This browser cannot open a live connection. Runs still fly; reload the page to see where "
    "they have come to."
)


def tell(error: Exception) -> None:
    """Show an error that no callback expected; for ``Dash(on_error=...)``. Its text stays here."""
    logger.error("a callback failed", exc_info=error)
    show_error("Something went wrong", UNEXPECTED)


def register(app: Dash, services: Services) -> None:
    """Attach every callback to ``app``."""
    _register_address(app, services)
    _register_live(app, services)
    fly_callbacks.register(app, services)
    playback.register(
        app, lambda session_id, time_s: services.sessions.get(session_id).seek(time_s)
    )
    cursor_tools.register(app)
    library.register(app)
    live_callbacks.register(app, services.engine)
    runs_callbacks.register(app, services.store)
    present.register(app)
    tour.register(app)
    teach_callbacks.register(app, services.classroom, services.store)
    report_callbacks.register(app, services.desk)


def _register_address(app: Dash, services: Services) -> None:
    @app.callback(
        Output("page", "children"),
        Output("page-kind", "data"),
        Output("run-id", "data"),
        Output("page-title", "data"),
        Input("url", "pathname"),
        State("page-kind", "data"),
        State("session", "data"),
        websocket=True,
    )
    async def turn_page(
        path: str | None, kind: str | None, session_id: str
    ) -> tuple[Any, Any, Any, str]:
        """Show the page that the address names; a page that stays is left as it is."""
        address = await asyncio.to_thread(read_address, path or "/", services.store)
        if address.kind == kind == "fly":
            return no_update, no_update, address.run_id, address.title
        services.sessions.get(session_id).clear()
        try:
            page = await asyncio.to_thread(_page, address, services)
        except StoreError as error:
            page = missing.layout(sentence(str(error)))
        return page, address.kind, address.run_id, address.title

    in_browser(
        app,
        "workbench",
        "nameTab",
        Input("page-title", "data"),
    )
    in_browser(
        app,
        "mirrortwin",
        "markPage",
        Input("page-kind", "data"),
    )
    in_browser(
        app,
        "mirrortwin",
        "showRun",
        Input("run-id", "data"),
    )


def _page(address: Address, services: Services) -> html.Div:
    store = services.store
    match address.kind:
        case "fly":
            return fly.layout(replace(DEFAULT_FAULT, mode=address.mode or DEFAULT_FAULT.mode))
        case "runs":
            return runs_callbacks.page(store)
        case "faults" if address.mode is not None:
            return fault_page.mode_layout(address.mode, take("signs"))
        case "faults":
            return faults.catalogue_layout()
        case "results" | "compare":
            return library.layout(address, store, services.sandbox_prefix)
        case "help":
            return help.layout()
        case "teach":
            return teach_callbacks.layout(address.attempt_id, services.classroom)
        case _:
            return missing.layout(address.problem)


def _register_live(app: Dash, services: Services) -> None:
    # No output and no input: Dash starts such a callback on page load, and starts it again when a
    # lost connection is back.
    @app.callback(
        State("session", "data"), State("run-id", "data"), websocket=True, persistent=True
    )
    async def attend(session_id: str, run_id: str | None) -> None:
        """Serve this page for as long as it is open."""
        socket = ctx.websocket
        if socket is None:
            show_error("No live connection", NO_SOCKET)
            return
        await services.sessions.attend(session_id, run_id, Page(socket))

    @app.callback(
        Input("run-id", "data"),
        Input("awake", "data"),
        State("session", "data"),
        State("page-kind", "data"),
        websocket=True,
        prevent_initial_call=True,
    )
    async def follow(
        run_id: str | None, awake: float | None, session_id: str, kind: str | None
    ) -> None:
        """Follow the run that the address has come to name.

        A page that slept, in a frozen tab or a closed laptop, was given up: serve it again.
        """
        if kind != "fly":
            return
        session = services.sessions.get(session_id)
        session.show(run_id)
        # One that slept for long was forgotten, too; one that loads is about to be attended.
        is_left = session.abandoned or (ctx.triggered_id == "awake" and session.is_unattended)
        if ctx.websocket is not None and is_left:
            await services.sessions.attend(session_id, run_id, Page(ctx.websocket))

    in_browser(
        app,
        "tiles",
        "showFlight",
        Output("taken", "data"),
        Input("flight", "data"),
        Input("tile-specs", "data"),
    )
    drawn = {
        "report": report_panel.REPORT_NODES_ID,
        "answers": report_panel.ANSWER_NODES_ID,
        "ranking": fly.RANKING_NODES_ID,
    }
    for name, store in drawn.items():
        # With an output: Dash calls what has none only when its inputs change.
        in_browser(app, "draw", name, Output(name, "data-parts"), Input(store, "data"))
