"""The contract of pages: every folder keeps it, and the registry names every folder."""

import importlib
import pkgutil
from collections.abc import Iterator
from pathlib import Path

import pytest

import app.pages
from app.kit.addresses import MISSING, Address
from app.pages.contract import Page
from app.pages.registry import PAGES, page_of, read_address, tab_title
from core.store.store import RunStore

IN_NAVIGATION = [page for page in PAGES if page.nav_path is not None]


@pytest.fixture
def store(tmp_path: Path) -> Iterator[RunStore]:
    store = RunStore(tmp_path)
    yield store
    store.close()


def test_every_folder_that_has_a_page_is_registered() -> None:
    folders = [
        importlib.import_module(f"app.pages.{module.name}")
        for module in pkgutil.iter_modules(app.pages.__path__)
        if module.ispkg
    ]
    found = {folder.PAGE.kind for folder in folders if hasattr(folder, "PAGE")}
    assert found == {page.kind for page in PAGES}
    assert len(found) == len(PAGES)


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.kind)
def test_a_page_is_a_folder_with_its_layout(page: Page) -> None:
    folder = Path(app.pages.__path__[0]) / page.kind
    assert (folder / "page.py").is_file()
    assert page_of(Address(page.kind)) is page


@pytest.mark.parametrize("page", IN_NAVIGATION, ids=lambda page: page.kind)
def test_the_navigation_leads_to_the_page_it_names(page: Page, store: RunStore) -> None:
    assert page.nav_path is not None
    address = read_address(page.nav_path, store)
    assert (address.kind, address.problem) == (page.kind, "")
    assert tab_title(address) == f"{page.name} · MirrorTwin"
    claimed = [other.kind for other in PAGES if other.read(page.nav_path, store) is not None]
    assert claimed == [page.kind, MISSING], "no page takes the path of another"


def test_a_path_of_no_page_is_named(store: RunStore) -> None:
    address = read_address("/nowhere/at/all", store)
    assert address.kind == MISSING
    assert "/nowhere/at/all" in address.problem
