"""The page *Runs*: every stored run in a table."""

from dash import Dash, html
from fastapi import FastAPI

from app.kit.addresses import Address
from app.pages.contract import Page
from app.pages.runs import callbacks, files
from app.services import Services
from core.store.store import RunStore


class RunsPage(Page):
    """All runs: find, label, compare, export, import and delete them."""

    kind = "runs"
    name = "Runs"
    nav_path = "/runs"
    uploads = (files.IMPORT_PATH,)

    def read(self, path: str, store: RunStore) -> Address | None:
        """The table."""
        return Address(self.kind) if path == self.nav_path else None

    def layout(self, address: Address, services: Services) -> html.Div:
        """The table as the store stands."""
        return callbacks.current_layout(services.store)

    def register(self, app: Dash, services: Services) -> None:
        """Attach the callbacks of the table."""
        callbacks.register(app, services.store)

    def mount(self, server: FastAPI, services: Services) -> None:
        """Answer for exports, and take imports."""
        files.mount(server, services.store)


PAGE = RunsPage()
