"""All pages, in the order of the navigation. Adding one is its folder and a line in `FOLDERS`."""

from importlib import import_module

from app.kit.addresses import Address
from app.pages.contract import Page
from core.store.store import RunStore

FOLDERS = (
    "fly",
    "runs",
    "compare",
    "faults",
    "results",
    "teach",
    "help",
    "missing",  # the last: it takes every path
)

PAGES: tuple[Page, ...] = tuple(import_module(f"app.pages.{name}").PAGE for name in FOLDERS)


def page_of(address: Address) -> Page:
    """The page that shows an address."""
    return next(page for page in PAGES if page.kind == address.kind)


def read_address(path: str, store: RunStore) -> Address:
    """The page that a path names, and what it shows."""
    found = (page.read(path, store) for page in PAGES)
    return next(address for address in found if address is not None)


def tab_title(address: Address) -> str:
    """What the browser's tab says at an address."""
    name = page_of(address).name
    return f"{address.about}, {name} · MirrorTwin" if address.about else f"{name} · MirrorTwin"
