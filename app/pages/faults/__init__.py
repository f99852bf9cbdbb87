"""The pages *Faults*: the catalogue of failure modes, and a page for each mode."""

from dash import Dash, html

from app.kit.addresses import Address, mode_address, parts
from app.pages.contract import Page
from app.pages.faults import callbacks
from app.pages.faults.mode_page import mode_layout
from app.pages.faults.page import catalogue_layout
from app.services import Services
from core.experiments.stored import load_result
from core.store.store import RunStore


class FaultsPage(Page):
    """The FMEA catalogue and the knowledge about each of its modes."""

    kind = "faults"
    name = "Faults"
    nav_path = "/faults"

    def read(self, path: str, store: RunStore) -> Address | None:
        """The catalogue, or one mode."""
        head, mode = parts(path)
        if head != self.kind:
            return None
        return mode_address(self.kind, mode) if mode else Address(self.kind)

    def layout(self, address: Address, services: Services) -> html.Div:
        """The catalogue, or the mode beside what the sign matrix found for it."""
        if address.item is None:
            return catalogue_layout()
        return mode_layout(address.item, load_result("signs"))

    def register(self, app: Dash, services: Services) -> None:
        """Attach the search and the flown signatures."""
        callbacks.register(app)


PAGE = FaultsPage()
