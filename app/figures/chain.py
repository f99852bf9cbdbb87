"""A causal chain as a diagram: steps from defect to gauge, and the gauges that each one moves."""

from collections.abc import Sequence

from dash import html

from app.kit.attributes import attributes
from core.channels import channel
from core.knowledge.knowledge import ChainStep, Sign, resolve

ARROWS: dict[Sign, str] = {"+": "↑", "-": "↓", "0": "=", "~": "~"}
WORDS: dict[Sign, str] = {"+": "rises", "-": "falls", "0": "holds", "~": "may move"}


def chain_diagram(steps: Sequence[ChainStep], cylinder: int) -> html.Ol:
    """The chain, read downwards, for an affected ``cylinder``; gauges stand to the right."""
    return html.Ol([_step(step, cylinder) for step in steps], className="chain")


def gauge(names: Sequence[str], sign: Sign) -> html.Li:
    """One gauge, or several of a kind that move alike, and which way."""
    labels = [channel(name).label for name in names]
    return html.Li(
        [
            html.Span(ARROWS[sign], className="gauge-sign", **attributes(aria_hidden="true")),
            html.Span(short_list(labels)),
            html.Span(f" {WORDS[sign]}", className="visually-hidden"),
        ],
        className="gauge",
        title=f"{short_list(labels)} {WORDS[sign]}",
        **attributes(data_sign=sign),
    )


def short_list(labels: Sequence[str]) -> str:
    """Labels of one kind with the kind said once.

    >>> short_list(["CHT 1", "CHT 3"]), short_list(["Fuel flow"])
    ('CHT 1, 3', 'Fuel flow')
    """
    first, *rest = labels
    return ", ".join([first, *(label.rpartition(" ")[2] for label in rest)])


def _step(step: ChainStep, cylinder: int) -> html.Li:
    gauges = [gauge(resolve(item.channel, cylinder), item.sign) for item in step.channels]
    unseen = html.Span("no gauge sees this", className="chain-unseen note")
    return html.Li(
        [
            html.Div(step.text, className="chain-box"),
            html.Div(
                html.Ul(gauges, className="gauges") if gauges else unseen,
                className="chain-out" if gauges else "chain-out chain-blind",
            ),
        ],
        className="chain-step",
    )
