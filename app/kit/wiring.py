"""Access of callbacks to the page: setting properties, running functions in the browser."""

from typing import Any, NamedTuple

import dash_mantine_components as dmc
from dash import ClientsideFunction, Dash, Input, Output, State, set_props


class Update(NamedTuple):
    """One property of one component of the page, to be set."""

    component_id: str
    prop: str
    value: Any


def alert(kind: str, title: str, message: str) -> Update:
    """An alert at the head of the run. ``kind`` is error or warning."""
    colour = {"error": "red", "warning": "yellow"}[kind]
    return Update(
        "alert", "children", dmc.Alert(message, title=title, color=colour, variant="light", mt=10)
    )


def show_error(title: str, message: str) -> None:
    """Show an error on the page, from within a callback."""
    update = alert("error", title, message)
    set_props(update.component_id, {update.prop: update.value})


def in_browser(
    app: Dash,
    namespace: str,
    function: str,
    *dependencies: Output | Input | State,
    on_load: bool = True,
) -> None:
    """Attach a function of ``assets/*.js``; without ``on_load`` it waits for a first change."""
    app.clientside_callback(  # type: ignore[no-untyped-call]  # dash types callback alone
        ClientsideFunction(namespace, function), *dependencies, prevent_initial_call=not on_load
    )
