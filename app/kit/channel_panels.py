"""All channels of a page, in panels by subsystem."""

from collections.abc import Callable
from itertools import groupby

from dash import html

from app.kit.attributes import attributes
from core.channels import CHANNELS, Channel

SUBSYSTEM_ORDER = ("engine", "fuel", "oil", "electrical", "flight")


def channel_panels(tile: Callable[[int, Channel], html.Figure], shown: str) -> list[html.Section]:
    """A panel for each subsystem, with the ``tile`` of each channel, by number and channel.

    ``shown`` names the content of a panel for screen readers, such as "sensors".
    """
    numbered = sorted(
        enumerate(CHANNELS), key=lambda item: SUBSYSTEM_ORDER.index(item[1].subsystem)
    )
    return [
        html.Section(
            [
                html.H2(subsystem.capitalize(), className="panel-title"),
                html.Div(
                    [tile(index, channel) for index, channel in group],
                    className=f"tiles tiles-{subsystem}",
                ),
            ],
            className=f"panel panel-{subsystem}",
            **attributes(aria_label=f"{subsystem.capitalize()} {shown}"),
        )
        for subsystem, group in groupby(numbered, key=lambda item: item[1].subsystem)
    ]
