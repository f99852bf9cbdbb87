"""The contract of a page with the router, the shell and the server.

A page is a folder of this package whose ``__init__`` holds one `Page` as ``PAGE``, and one line in
`app.pages.registry`. In every folder ``page.py`` lays out, ``callbacks.py`` attaches callbacks, and
``files.py`` answers over plain HTTP.
"""

from typing import Protocol

from dash import Dash
from dash.development.base_component import Component
from fastapi import FastAPI

from app.kit.addresses import Address
from app.services import Services
from core.store.store import RunStore


class Page(Protocol):
    """One page of the app.

    ``kind`` is its id, ``name`` its title, ``nav_path`` where the navigation leads, None
    for a page that is not in it. ``keeps_layout``: whether the page stays as it is when the address
    changes within it. ``uploads``: addresses whose request bodies the page limits itself.
    """

    kind: str
    name: str
    nav_path: str | None
    keeps_layout: bool = False
    uploads: tuple[str, ...] = ()

    def read(self, path: str, store: RunStore) -> Address | None:
        """What of this page a path names; None for a path of other pages."""

    def layout(self, address: Address, services: Services) -> Component:
        """The page at an address of its kind; raises `StoreError`. Called on a thread."""

    def register(self, app: Dash, services: Services) -> None:
        """Attach the callbacks of the page to ``app``."""
        return

    def mount(self, server: FastAPI, services: Services) -> None:
        """Add the HTTP routes of the page to ``server``."""
        return
