"""The pages *Teach*: mystery flights, in which a learner finds the fault."""

from dash import Dash, html

from app.kit.addresses import Address, missing, parts
from app.pages.contract import Page
from app.pages.teach import callbacks
from app.services import Services
from core.store.store import RunStore
from core.teach.classroom import has_attempt


class TeachPage(Page):
    """The start of a mystery flight, an open one, and one that is over."""

    kind = "teach"
    name = "Teach"
    nav_path = "/teach"

    def read(self, path: str, store: RunStore) -> Address | None:
        """The start, or a mystery flight of this server."""
        head, attempt_id = parts(path)
        if head != self.kind:
            return None
        if attempt_id and not has_attempt(store, attempt_id):
            return missing(f"There is no mystery flight “{attempt_id[:60]}” here.")
        return Address(self.kind, item=attempt_id or None)

    def layout(self, address: Address, services: Services) -> html.Div:
        """The start, or the mystery flight as it stands."""
        return callbacks.current_layout(address.item, services.classroom)

    def register(self, app: Dash, services: Services) -> None:
        """Attach the callbacks of a mystery flight."""
        callbacks.register(app, services.classroom, services.store)


PAGE = TeachPage()
