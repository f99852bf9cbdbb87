"""The tour: an invitation on the first visit, and the stops that ``shell/tour.js`` shows."""

import json
from dataclasses import asdict

from dash import Dash, Input, Output, html

from app.kit.attributes import attributes
from app.kit.glossary import tour_stops
from app.kit.wiring import in_browser


def invitation() -> html.Div:
    """One line above the page, which the browser shows until it is answered once."""
    stops = tour_stops()
    return html.Div(
        [
            html.Span(f"New here? A tour of {len(stops)} stops takes a minute."),
            html.Button("Take the tour", type="button", **attributes(data_tour="start")),
            html.Button("No, thanks", type="button", **attributes(data_tour="decline")),
        ],
        id="tour-invitation",
        hidden=True,
        role="region",
        **attributes(
            aria_label="Invitation to the tour",
            data_stops=json.dumps([asdict(stop) for stop in stops]),
        ),
    )


def register(app: Dash) -> None:
    """Attach the visibility of the invitation to ``app``."""
    in_browser(
        app, "tour", "invite", Output("tour-invitation", "hidden"), Input("page-kind", "data")
    )
