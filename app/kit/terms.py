"""Glossary terms with their meaning as a tooltip (``shell/terms.js``)."""

from dash import html

from app.kit.attributes import attributes
from app.kit.glossary import glossary


def term(term_id: str, text: str = "") -> html.Span:
    """A term of the glossary with its meaning; ``text`` is what the page shows.

    Raises ``KeyError`` for a word that the glossary lacks.
    """
    entry = glossary()[term_id]
    meaning = f"{entry.long}. {entry.text}" if entry.long else entry.text
    return html.Span(
        text or entry.name, className="term", tabIndex=0, **attributes(data_meaning=meaning)
    )
