"""The pages *Results*: the experiments of the paper and of this code."""

from dash import Dash, html
from fastapi import FastAPI

from app.kit.addresses import Address, parts
from app.pages.contract import Page
from app.pages.results import callbacks, files
from app.pages.results.page import layout
from app.services import Services
from core.experiments.registry import EXPERIMENTS
from core.store.store import RunStore


class ResultsPage(Page):
    """The overview, and a page for each experiment."""

    kind = "results"
    name = "Results"
    nav_path = "/results"

    def read(self, path: str, store: RunStore) -> Address | None:
        """The overview, or an experiment."""
        head, name = parts(path)
        if head != self.kind or (name and name not in EXPERIMENTS):
            return None
        if not name:
            return Address(self.kind)
        return Address(self.kind, item=name, about=EXPERIMENTS[name].title)

    def layout(self, address: Address, services: Services) -> html.Div:
        """The overview, or the result as it is stored."""
        return layout(address.item, services.sandbox_prefix)

    def register(self, app: Dash, services: Services) -> None:
        """Attach the callbacks of the confusion matrices."""
        callbacks.register(app, services)

    def mount(self, server: FastAPI, services: Services) -> None:
        """Answer for pictures and interactive figures."""
        files.mount(server)


PAGE = ResultsPage()
