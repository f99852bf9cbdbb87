"""What surrounds every page: the header, the address, and the page that the address names."""

from dataclasses import dataclass
from typing import Literal

import dash_mantine_components as dmc
from dash import dcc, html

from app import theme
from app.live import new_session_id
from app.pages.attributes import attributes
from core.errors import StoreError
from core.jobs.records import valid_run_id
from core.jobs.store import RunStore

PageKind = Literal["fly", "runs", "missing"]

RUN_PREFIX = "/run/"


@dataclass(frozen=True, slots=True)
class Address:
    """What a path names. ``problem`` says to a person why there is nothing there."""

    kind: PageKind
    run_id: str | None = None
    problem: str = ""


def run_path(run_id: str) -> str:
    """The address of a run."""
    return RUN_PREFIX + run_id


def read_address(path: str, store: RunStore) -> Address:
    """The page and the run that a path names."""
    if path in ("", "/"):
        return Address("fly")
    if path == "/runs":
        return Address("runs")
    if not path.startswith(RUN_PREFIX):
        return Address("missing", problem=f"There is no page at {path[:80]}.")
    run_id = path.removeprefix(RUN_PREFIX)
    if not valid_run_id(run_id):
        return Address(
            "missing",
            problem=f"“{run_id[:60]}” is not the name of a run. "
            "Runs are named like 20261123T061500-k3x9q2wz.",
        )
    try:
        store.get(run_id)
    except StoreError:
        return Address(
            "missing",
            problem=f"There is no run {run_id} in this store. It may belong to another server.",
        )
    return Address("fly", run_id)


def layout() -> dmc.MantineProvider:
    """The shell, with a session of its own: Dash calls this for each page load."""
    return dmc.MantineProvider(
        [
            dcc.Location(id="url", refresh=False),
            dcc.Store(id="session", data=new_session_id()),
            dcc.Store(id="run-id", data=None),
            dcc.Store(id="page-kind", data=None),
            dcc.Store(id="scheme", data=None),
            dcc.Store(id="taken", data=None),
            dcc.Store(id="awake", data=None),
            html.A("Skip to the page", href="#page", className="skip-link"),
            dmc.AppShell(
                [
                    dmc.AppShellHeader(_header(), className="header"),
                    dmc.AppShellMain(html.Div(id="page", tabIndex=-1)),
                ],
                header={"height": 44},
                padding=0,
            ),
        ],
        defaultColorScheme="auto",
        theme={
            "fontFamily": theme.FONT_FAMILY,
            "fontFamilyMonospace": theme.MONO_FAMILY,
            "primaryColor": "blue",
            "primaryShade": {"light": 7, "dark": 7},
            "defaultRadius": "sm",
            "cursorType": "pointer",
            "respectReducedMotion": True,
        },
    )


def _header() -> list[object]:
    return [
        dcc.Link("MirrorTwin", href="/", className="brand"),
        html.Nav(
            [
                dcc.Link("Fly", href="/", id="nav-fly"),
                dcc.Link("Runs", href="/runs", id="nav-runs"),
            ],
            **attributes(aria_label="Pages"),
        ),
        html.Span("Cessna 172P, simulated", className="note header-note"),
        dmc.ColorSchemeToggle(
            lightIcon=_icon("☀"),
            darkIcon=_icon("☾"),
            variant="subtle",
            size="md",
            color="gray",
            **attributes(aria_label="Switch between light and dark"),
        ),
    ]


def _icon(character: str) -> html.Span:
    return html.Span(character, **attributes(aria_hidden="true"))
