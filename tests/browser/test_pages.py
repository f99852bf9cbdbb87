"""The pages beside Fly in a real browser: catalogue, results, comparison."""

import re
from collections.abc import Iterator
from typing import Any

import pytest
from playwright.sync_api import Page, expect

from core.diagnosis.predict import load_diagnoser
from core.fmea.catalogue import catalogue
from core.fmea.fault import Fault
from core.report.case.case import open_case
from core.report.grounded import grounded_template
from core.store.store import RunStore
from core.twin.flight import fly_pair
from core.twin.plan import Plan

pytestmark = [pytest.mark.browser, pytest.mark.usefixtures("without_3d")]

TIMEOUT_MS = 120_000


@pytest.fixture(autouse=True)
def patient(page: Page) -> None:
    """Give a busy machine time."""
    page.set_default_timeout(TIMEOUT_MS)
    expect.set_options(timeout=TIMEOUT_MS)


@pytest.fixture(scope="module")
def run_ids(server: Any) -> Iterator[list[str]]:
    """Two short runs, stored beside the server as another process would."""
    store = RunStore(server.store)
    ids = []
    for fault in (Fault("nominal"), Fault("engine_failure", 0.8, 20.0)):
        plan = Plan(duration_s=60.0, seed=11)
        pair = fly_pair(plan, fault)
        run_id = store.create(plan, fault).id
        store.save_pair(run_id, pair)
        diagnosis = load_diagnoser().diagnose(pair)
        store.save_result(run_id, diagnosis, grounded_template(open_case(diagnosis)))
        ids.append(run_id)
    yield ids
    store.close()


def here(page: Page) -> str:
    """The page that the header says is shown."""
    return page.locator(".header nav a[aria-current=page]").inner_text()


def test_from_a_symptom_to_the_fault_and_into_the_air(
    page: Page, server: Any, console_errors: list[str]
) -> None:
    page.goto(f"{server.url}/faults")
    rows = page.locator(".matrix tbody th[scope=row]")
    expect(rows).to_have_count(len(catalogue()))
    expect(page).to_have_title("Faults · MirrorTwin")
    assert here(page) == "Faults"
    page.get_by_label("Search").fill("cowl seal blown back")
    hit = page.locator(".hits li").first
    expect(hit).to_contain_text("Baffle seal")
    assert rows.count() < len(catalogue())
    # All of it by keyboard.
    hit.get_by_role("link").focus()
    page.keyboard.press("Enter")
    expect(page.get_by_role("heading", level=1)).to_have_text("Baffle seal")
    expect(page).to_have_title("Baffle seal, Faults · MirrorTwin")
    expect(page.locator(".growth .js-line").first).to_be_attached()
    assert page.locator(".growth .js-line").count() >= 3 * 3
    page.locator("#fly-this").focus()
    page.keyboard.press("Enter")
    expect(page.locator("#field-fault")).to_have_value("Baffle seal")
    expect(page.locator("#run-subtitle")).to_contain_text("baffle seal")
    assert page.evaluate("location.pathname") == "/fly/baffle_seal"
    assert console_errors == []


def test_a_fault_that_nobody_knows_is_told(page: Page, server: Any) -> None:
    answer = page.goto(f"{server.url}/faults/nonsense")
    assert answer is not None and answer.status == 404
    expect(page.get_by_role("heading", level=1)).to_have_text("Nothing here")
    expect(page.locator("#page")).to_contain_text("“nonsense”")
    expect(page.locator(".header nav a[aria-current=page]")).to_have_count(0)


def test_results_are_shown_beside_the_papers(
    page: Page, server: Any, console_errors: list[str]
) -> None:
    page.goto(f"{server.url}/results")
    expect(page.locator(".overview")).to_be_visible()
    assert here(page) == "Results"
    page.locator(".overview").get_by_role("link", name="Table 5").click()
    expect(page.locator(".js-plotly-plot .point").first).to_be_visible()
    expect(page.locator(".score-table")).to_contain_text("1893.4")
    page.locator(".results-nav").get_by_role("link", name="The shipped model").click()
    expect(page.locator(".confusion .js-plotly-plot").first).to_be_visible()
    page.locator(".results-nav").get_by_role("link", name="Fig. 6").click()
    picture = page.locator(".paper-figure")
    expect(picture).to_be_visible()
    picture.evaluate("image => image.decode()")
    assert picture.evaluate("image => image.naturalWidth") > 1000
    assert console_errors == []


def test_runs_are_chosen_and_laid_over_each_other(
    page: Page, server: Any, run_ids: list[str], console_errors: list[str]
) -> None:
    page.goto(f"{server.url}/compare")
    for name in ("Nominal · 5,000 ft, seed 11", "Engine failure, severity 0.80"):
        box = page.get_by_role("textbox", name="Runs, up to 6")
        box.click()
        box.fill(name[:14])
        page.get_by_role("option", name=name).first.click()
        expect(page.locator(".differences thead")).to_contain_text(
            name.split(" ·")[0].split(",")[0]
        )
    lines = page.locator("#compare-channels-figure .scatterlayer .js-line")
    expect(lines).to_have_count(2 * 6)
    assert page.evaluate("location.pathname") == "/compare/" + ",".join(run_ids)
    expect(page.locator(".differences")).to_contain_text("Severity")
    page.get_by_text("Residuals", exact=True).click()
    page.get_by_text("Paths", exact=True).click()
    expect(page.locator("#compare-track .scatterlayer .js-line")).to_have_count(2)
    expect(page.locator("#compare-channel-controls")).to_be_hidden()
    space = page.locator(".space")
    expect(space.locator("canvas").first).to_be_visible()
    expect(space).to_have_attribute(
        "aria-label", re.compile(r"Engine failure, [\d,]+ ft .* at \d+:\d\d")
    )
    seen_from = once_changed(page, None)
    space.focus()
    page.keyboard.press("ArrowRight")
    once_changed(page, seen_from)
    page.get_by_text("True to scale").click()
    expect(page.locator("figcaption", has_text="In space, to scale")).to_be_visible()
    page.reload()
    expect(lines).to_have_count(2 * 6)
    assert console_errors == []


def once_changed(page: Page, was: float | None) -> float:
    """From where the paths in space are looked at, as soon as that is not what it was."""
    for _ in range(200):
        east = page.evaluate(
            "document.querySelector('#compare-space .js-plotly-plot')"
            "?._fullLayout?.scene?.camera.eye.x ?? null"
        )
        if east != was:
            return float(east)
        page.wait_for_timeout(50)
    raise AssertionError(f"still looked at from {was}")


@pytest.mark.slow
def test_a_comparison_of_the_paper_flies_what_is_missing(
    page: Page, server: Any, console_errors: list[str]
) -> None:
    page.goto(f"{server.url}/compare")
    page.get_by_role("link", name="Fig. 7").click()
    page.get_by_role("button", name="Fly 6").click()
    expect(page.locator("#compare-channels-figure .scatterlayer .js-line")).to_have_count(6 * 6)
    expect(page.locator(".differences thead a")).to_have_count(6)
    page.get_by_role("link", name="Fig. 6").click()
    expect(page.locator("#compare-side .scatterlayer .js-line")).to_have_count(6)
    assert console_errors == []


@pytest.mark.parametrize("path", ["/faults", "/faults/engine_failure", "/results", "/compare"])
def test_pages_fit_a_telephone(page: Page, server: Any, path: str) -> None:
    page.set_viewport_size({"width": 390, "height": 844})
    page.goto(server.url + path)
    expect(page.locator(".header nav a[aria-current=page]")).to_be_visible()
    expect(page.get_by_role("heading", level=1)).to_be_visible()
    assert page.evaluate("document.documentElement.scrollWidth") <= 390
