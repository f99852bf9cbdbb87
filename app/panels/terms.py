"""Words that explain themselves: pointed at, tapped or reached by Tab."""

import dash_mantine_components as dmc
from dash import html

from app.glossary import glossary


def term(term_id: str, text: str = "") -> dmc.Tooltip:
    """A word of the glossary with its meaning in a tooltip; ``text`` is what stands on the page.

    Raises ``KeyError`` for a word that the glossary lacks.
    """
    entry = glossary()[term_id]
    meaning = f"{entry.long}. {entry.text}" if entry.long else entry.text
    return dmc.Tooltip(
        html.Span(text or entry.name, className="term", tabIndex=0),
        label=meaning,
        multiline=True,
        w=280,
        withArrow=True,
        openDelay=200,
        events={"hover": True, "focus": True, "touch": True},
        boxWrapperProps={"display": "inline-block"},
    )
