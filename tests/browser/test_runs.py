"""The page Runs in a real browser: find, mark, take along, throw away, have back."""

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Locator, Page, expect

from core.diagnosis.predict import load_diagnoser
from core.fmea.fault import Fault
from core.report.case.case import open_case
from core.report.grounded import grounded_template
from core.store.store import RunStore
from core.twin.flight import fly_pair
from core.twin.plan import Plan

pytestmark = [pytest.mark.browser, pytest.mark.usefixtures("without_3d")]

TIMEOUT_MS = 120_000
MARKUP = "<img src=x onerror=document.title='owned'>"


@pytest.fixture(scope="module")
def store(start_one_server: Any) -> Iterator[tuple[str, RunStore]]:
    """A server of our own, since runs are deleted, and three runs stored beside it."""
    server = start_one_server()
    store = RunStore(server.store)
    plan = Plan(duration_s=60.0, seed=11)
    for mode in ("nominal", "engine_failure", "baffle_crack"):
        fault = Fault(mode, 0.8, 20.0)
        pair = fly_pair(plan, fault)
        run_id = store.create(plan, fault).id
        diagnosis = load_diagnoser().diagnose(pair)
        store.save_pair(run_id, pair)
        store.save_result(run_id, diagnosis, grounded_template(open_case(diagnosis)))
    yield server.url, store
    store.close()


def test_only_what_is_seen_is_deleted_exported_and_compared(
    page: Page, store: tuple[str, RunStore], console_errors: list[str]
) -> None:
    page.set_default_timeout(TIMEOUT_MS)
    expect.set_options(timeout=TIMEOUT_MS)
    url, runs = store
    (crack,) = (each.id for each in runs.records() if each.fault.mode == "baffle_crack")
    page.goto(f"{url}/runs")
    rows = page.locator(".ag-center-cols-container .ag-row")
    search = page.get_by_label("Search runs")
    expect(rows).to_have_count(3)
    page.locator(".ag-header-select-all input").click()
    expect(page.get_by_role("button", name="Delete 3")).to_be_enabled()

    search.fill("baffle")
    expect(rows).to_have_count(1)
    expect(page.get_by_role("button", name="Compare 1")).to_be_enabled()
    expect(page.get_by_role("button", name="Delete 1")).to_be_enabled()
    expect(page.locator("#runs-hidden")).to_have_text("2 more selected, hidden by the filter")
    page.get_by_role("button", name="Export 1").click()
    everything = page.get_by_role("menuitem", name=re.compile("Everything"))
    expect(everything).to_have_attribute("href", f"/runs/files?id={crack}")
    with page.expect_download() as log:
        page.get_by_role("menuitem", name=re.compile("Faulted flight")).click()
    assert crack in log.value.url

    # Nothing is seen: nothing can be done.
    search.fill("no such run")
    expect(rows).to_have_count(0)
    expect(page.get_by_role("button", name="Delete", exact=True)).to_be_disabled()
    expect(page.get_by_role("button", name="Compare", exact=True)).to_be_disabled()

    # A selection that was hidden comes back with its rows.
    search.fill("")
    expect(page.get_by_role("button", name="Delete 3")).to_be_enabled()
    expect(page.locator("#runs-hidden")).to_be_empty()

    search.fill("baffle")
    page.get_by_role("button", name="Delete 1").click()
    expect(page.locator("#runs-notice")).to_contain_text("1 run deleted.")
    expect(rows).to_have_count(0)
    assert {each.fault.mode for each in runs.records()} == {"nominal", "engine_failure"}
    search.fill("")
    expect(rows).to_have_count(2)
    page.get_by_role("button", name="Undo").click()
    expect(rows).to_have_count(3)
    assert len(runs.records()) == 3
    assert console_errors == []


def test_runs_are_found_marked_exported_deleted_and_had_back(
    page: Page, store: tuple[str, RunStore], console_errors: list[str], tmp_path: Path
) -> None:
    page.set_default_timeout(TIMEOUT_MS)
    expect.set_options(timeout=TIMEOUT_MS)
    url, runs = store
    page.goto(f"{url}/runs")
    rows = page.locator(".ag-center-cols-container .ag-row")
    expect(rows).to_have_count(3)

    def cell(fault: str, column: str) -> Locator:
        return rows.filter(has_text=fault).locator(f"[col-id={column}]")

    # Written in place, kept in the store, and text whatever it looks like.
    cell("Engine failure", "tags").dblclick()
    page.keyboard.type(f"shop floor, {MARKUP[:30]}")
    page.keyboard.press("Enter")
    expect(cell("Engine failure", "tags").locator(".runs-tag")).to_have_count(2)
    cell("Engine failure", "note").dblclick()
    page.keyboard.type(MARKUP)
    page.keyboard.press("Enter")
    expect(cell("Engine failure", "note")).to_have_text(MARKUP)
    cell("Nominal", "tags").dblclick()
    page.keyboard.type("x" * 40)
    page.keyboard.press("Enter")
    expect(page.locator("#runs-problem")).to_contain_text("1 to 32 characters")
    expect(cell("Nominal", "tags")).to_have_text("")
    page.reload()
    expect(cell("Engine failure", "note")).to_have_text(MARKUP)
    expect(page).to_have_title("Runs · MirrorTwin")

    page.get_by_label("Search runs").fill("shop floor")
    expect(rows).to_have_count(1)
    # By keyboard alone: the cell with the focus chooses its row and opens its run.
    cell("Engine failure", "fault").focus()
    page.keyboard.press("Space")
    expect(page.get_by_role("button", name="Delete")).to_be_enabled()
    page.get_by_role("button", name="Export").click()
    with page.expect_download() as log:
        page.get_by_role("menuitem", name=re.compile("Faulted flight")).click()
    assert log.value.suggested_filename.endswith("-faulted.csv")
    page.get_by_role("button", name="Export").click()
    with page.expect_download() as parcel:
        page.get_by_role("menuitem", name=re.compile("Everything")).click()
    parcel.value.save_as(tmp_path / "run.zip")

    page.get_by_role("button", name="Delete").click()
    expect(page.locator("#runs-notice")).to_have_text(
        "1 run deleted. You can undo this for 24 hours, or until the disk is full."
    )
    expect(rows).to_have_count(0)
    page.reload()
    expect(rows).to_have_count(2)
    page.get_by_role("button", name="Undo").click()
    expect(rows).to_have_count(3)
    expect(cell("Engine failure", "note")).to_have_text(MARKUP)
    assert len(runs.records()) == 3

    # Deleted again, and brought back from the file.
    cell("Engine failure", "fault").focus()
    page.keyboard.press("Space")
    page.get_by_role("button", name="Delete").click()
    expect(rows).to_have_count(2)
    with page.expect_file_chooser() as chooser:
        page.get_by_role("button", name="Import").click()
    chooser.value.set_files(tmp_path / "run.zip")
    expect(page.locator("#runs-notice")).to_contain_text("1 run imported")
    expect(cell("Engine failure", "note")).to_have_text(MARKUP)
    assert console_errors == []

    for fault in ("Nominal", "Engine failure"):
        rows.filter(has_text=fault).get_by_role("checkbox").click()
    page.get_by_role("button", name="Compare 2").click()
    expect(page.locator("#compare-channels-figure .scatterlayer .js-line").first).to_be_visible()
    page.go_back()
    cell("Baffle crack", "fault").focus()
    page.keyboard.press("Enter")
    expect(page.locator("#run-title")).to_contain_text("Baffle crack")
    assert page.title() != "owned"
    assert console_errors == []
