"""The page *Help*: the tour, the keys, the glossary."""

from dash import html

from app.kit.addresses import Address, parts
from app.pages.contract import Page
from app.pages.help.page import layout
from app.services import Services
from core.store.store import RunStore


class HelpPage(Page):
    """One page, reached by the question mark in the header."""

    kind = "help"
    name = "Help"
    nav_path = None

    def read(self, path: str, store: RunStore) -> Address | None:
        """The page."""
        return Address(self.kind) if parts(path) == (self.kind, "") else None

    def layout(self, address: Address, services: Services) -> html.Div:
        """The page."""
        return layout()


PAGE = HelpPage()
