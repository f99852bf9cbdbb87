"""The router: shows the page that the address names, and attaches the callbacks of all pages."""

import asyncio
import logging
from typing import Any

from dash import Dash, Input, Output, State, no_update

from app.kit import tour
from app.kit.addresses import missing
from app.kit.wiring import in_browser, show_error
from app.kit.words import sentence
from app.pages.registry import PAGES, page_of, read_address, tab_title
from app.services import Services
from app.sessions import UNEXPECTED_ERROR
from core.errors import StoreError

logger = logging.getLogger(__name__)


def report_unexpected(error: Exception) -> None:
    """Log an error that no callback expected, and show that there was one; its text stays here."""
    logger.error("a callback failed", exc_info=error)
    show_error("Something went wrong", UNEXPECTED_ERROR)


def register(app: Dash, services: Services) -> None:
    """Attach every callback to ``app``."""
    _register_address(app, services)
    tour.register(app)
    for page in PAGES:
        page.register(app, services)


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
        """Show the page that the address names; a page that keeps its layout is left as it is."""
        address = await asyncio.to_thread(read_address, path or "/", services.store)
        page, title = page_of(address), tab_title(address)
        if address.kind == kind and page.keeps_layout:
            return no_update, no_update, address.run_id, title
        services.sessions.get(session_id).clear()
        try:
            layout = await asyncio.to_thread(page.layout, address, services)
        except StoreError as error:
            nothing = missing(sentence(str(error)))
            layout = page_of(nothing).layout(nothing, services)
        return layout, address.kind, address.run_id, title

    in_browser(app, "workbench", "nameTab", Input("page-title", "data"))
    in_browser(app, "mirrortwin", "markPage", Input("page-kind", "data"))
    in_browser(app, "mirrortwin", "showRun", Input("run-id", "data"))
