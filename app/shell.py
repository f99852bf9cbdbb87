"""The shell: what surrounds every page, with the header and its navigation."""

import dash_mantine_components as dmc
from dash import dcc, html

from app import theme
from app.kit import tour
from app.kit.attributes import attributes
from app.pages.registry import PAGES
from app.sessions import new_session_id


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
            dcc.Store(id="page-title", data=None),
            html.A("Skip to the page", href="#page", className="skip-link"),
            dmc.AppShell(
                [
                    dmc.AppShellHeader(_header(), className="header"),
                    dmc.AppShellMain([tour.invitation(), html.Div(id="page", tabIndex=-1)]),
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
            "primaryShade": {"light": 8, "dark": 8},
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
                dcc.Link(page.name, href=page.nav_path, id=f"nav-{page.kind}")
                for page in PAGES
                if page.nav_path is not None
            ],
            **attributes(aria_label="Pages"),
        ),
        html.Span("Cessna 172P, simulated", className="note header-note"),
        dcc.Link(
            [html.Span("Help"), html.I("?", **attributes(aria_hidden="true"))],
            href="/help",
            id="nav-help",
            className="header-help",
        ),
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
