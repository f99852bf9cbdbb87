"""The page *Compare*: several stored runs in one picture."""

from dash import Dash, html

from app.figures.comparison import MAX_COMPARED
from app.kit.addresses import Address, missing, parts, run_problem
from app.pages.compare import callbacks
from app.pages.compare.page import layout
from app.pages.contract import Page
from app.services import Services
from core.experiments.registry import COMPARED
from core.store.store import RunStore


class ComparePage(Page):
    """Runs chosen by hand, or a set of runs of the paper by its name."""

    kind = "compare"
    name = "Compare"
    nav_path = "/compare"

    def read(self, path: str, store: RunStore) -> Address | None:
        """Nothing chosen yet, a set of runs by name, or runs separated by commas."""
        head, name = parts(path)
        if head != self.kind:
            return None
        if name in ("", *COMPARED):
            return Address(self.kind, item=name or None)
        run_ids = tuple(dict.fromkeys(name.split(",")))
        if len(run_ids) > MAX_COMPARED:
            return missing(f"At most {MAX_COMPARED} runs are compared at once, not {len(run_ids)}.")
        problems = (run_problem(run_id, store) for run_id in run_ids)
        problem = next(filter(None, problems), "")
        return missing(problem) if problem else Address(self.kind, run_ids=run_ids)

    def layout(self, address: Address, services: Services) -> html.Div:
        """The comparison."""
        return layout(address.run_ids, address.item, services.store)

    def register(self, app: Dash, services: Services) -> None:
        """Attach the callbacks of the comparison."""
        callbacks.register(app, services)


PAGE = ComparePage()
