"""The page *Fly*: plan a flight, break the engine, and watch it beside its healthy mirror."""

from dataclasses import replace

from dash import Dash, html
from fastapi import FastAPI

from app.kit.addresses import (
    PRESENT_PREFIX,
    RUN_PREFIX,
    Address,
    missing,
    mode_address,
    parts,
    run_problem,
)
from app.pages.contract import Page
from app.pages.fly import callbacks, files
from app.pages.fly.page import layout
from app.pages.fly.setup import DEFAULT_FAULT
from app.pages.report import callbacks as report_callbacks
from app.pages.report import files as report_files
from app.services import Services
from core.store.store import RunStore


class FlyPage(Page):
    """A new flight, a stored or flying run, and the same run on a wall; with the panel *Report*."""

    kind = "fly"
    name = "Fly"
    nav_path = "/"
    keeps_layout = True

    def read(self, path: str, store: RunStore) -> Address | None:
        """A new flight, one with a mode filled in, or a run."""
        if path in ("", "/"):
            return Address(self.kind)
        for prefix in (RUN_PREFIX, PRESENT_PREFIX):
            if path.startswith(prefix):
                run_id = path.removeprefix(prefix)
                problem = run_problem(run_id, store)
                return missing(problem) if problem else Address(self.kind, run_id=run_id)
        head, mode = parts(path)
        return mode_address(self.kind, mode) if head == "fly" and mode else None

    def layout(self, address: Address, services: Services) -> html.Div:
        """The page before any run; the session fills in the run that the address names."""
        return layout(replace(DEFAULT_FAULT, mode=address.item or DEFAULT_FAULT.mode))

    def register(self, app: Dash, services: Services) -> None:
        """Attach the callbacks of the page and of its report."""
        callbacks.register(app, services)
        report_callbacks.register(app, services.desk)

    def mount(self, server: FastAPI, services: Services) -> None:
        """Answer for samples in detail and for files of reports."""
        files.mount(server, services.engine, services.store)
        report_files.mount(server, services.store)


PAGE = FlyPage()
