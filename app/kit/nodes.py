"""Components as plain data, for the parts of the page that ``assets/web/draw.js`` draws.

Dash takes milliseconds for each component that it mounts, and a report has three hundred.
"""

from collections.abc import Sequence
from typing import Any

from dash.development.base_component import Component

Node = str | list[Any]
"""Text, or ``[tag, attributes, children]``."""

_ATTRIBUTES = {"className": "class", "tabIndex": "tabindex"}


def nodes(parts: Sequence[Any] | Component | str | None) -> list[Node]:
    """HTML components, or text, as what the browser draws; their order and nesting are kept."""
    if parts is None:
        return []
    if isinstance(parts, Component | str):
        return [_node(parts)]
    return [_node(part) for part in parts]


def _node(part: Component | str) -> Node:
    if isinstance(part, str):
        return part
    props = part.to_plotly_json()["props"]  # type: ignore[no-untyped-call]  # dash
    children = nodes(props.pop("children", None))
    named = {_ATTRIBUTES.get(name, name): value for name, value in props.items()}
    attributes = {name: value for name, value in named.items() if value is not None}
    return [type(part).__name__.lower(), attributes, children]
