"""The page for an address that names nothing."""

from dash import html

from app.kit.addresses import MISSING, Address, missing
from app.pages.contract import Page
from app.pages.missing.page import layout
from app.services import Services
from core.store.store import RunStore


class MissingPage(Page):
    """What is wrong with an address, and where to go on."""

    kind = MISSING
    name = "Nothing here"
    nav_path = None

    def read(self, path: str, store: RunStore) -> Address | None:
        """Every path: asked last, it takes those of no other page."""
        return missing(f"There is no page at {path[:80]}.")

    def layout(self, address: Address, services: Services) -> html.Div:
        """The problem, as a page."""
        return layout(address.problem)


PAGE = MissingPage()
