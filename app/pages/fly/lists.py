"""Lists of the results of a run: the events of its flight, and the leading classes."""

from collections.abc import Iterable, Sequence

from dash import html

from app.figures.probabilities import class_colours
from app.kit.words import event_line
from core.twin.events import FlightEvent
from core.units import percent

SHOWN_EVENTS = 4


def event_list(found: Sequence[FlightEvent]) -> html.Ul | None:
    """The events that a pilot would report of the faulted flight, the first few in time order.

    The ground comes before all else: it is why the flight is shorter than its plan.
    """
    if not found:
        return None
    found = sorted(found, key=lambda event: event.kind != "ground")
    lines = [html.Li(event_line(event)) for event in found[:SHOWN_EVENTS]]
    if len(found) > SHOWN_EVENTS:
        lines.append(html.Li(f"and {len(found) - SHOWN_EVENTS} more"))
    return html.Ul(lines, className="flight-events")


def ranking_list(
    names: dict[str, str], ranking: Iterable[str], shares: dict[str, float]
) -> html.Ol:
    """The leading classes as bars, best first, in the colours of the chart below."""
    ranking = list(ranking)
    colours = class_colours(ranking)
    return html.Ol(
        [
            html.Li(
                [
                    html.Span(names[mode], className="rank-name"),
                    html.Span(
                        html.Span(
                            className="rank-fill",
                            style={
                                "width": f"{100 * shares[mode]:.1f}%",
                                "backgroundColor": colours[mode],
                            },
                        ),
                        className="rank-bar",
                    ),
                    html.Span(percent(shares[mode]), className="rank-share mono"),
                ]
            )
            for mode in ranking
        ],
        className="ranking",
    )
