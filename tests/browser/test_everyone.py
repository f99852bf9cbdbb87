"""For everyone: axe-core on every page in both themes, the tour, words by keyboard, the wall."""

from typing import Any

import pytest
from axe_playwright_python.sync_playwright import Axe
from playwright.sync_api import Page, expect

from app.kit.glossary import glossary, tour_stops

pytestmark = pytest.mark.browser

TIMEOUT_MS = 120_000
PAGES = {
    "/": "#tile-0 canvas",
    "/runs": ".ag-row .ag-cell, .empty",
    "/compare": "h1",
    "/faults": ".matrix td",
    "/faults/baffle_seal": ".growth .js-line",
    "/results": ".overview",
    "/results/table5": ".score-table",
    "/teach": "#mystery-start",
    "/help": ".words",
    "/nothing-here": "h1",
}
"""Every kind of page, and what is there once it has come."""


@pytest.fixture(autouse=True)
def patient(page: Page) -> None:
    """Give a busy machine time."""
    page.set_viewport_size({"width": 1440, "height": 900})
    page.set_default_timeout(TIMEOUT_MS)
    expect.set_options(timeout=TIMEOUT_MS)


def complaints(page: Page) -> list[str]:
    """What axe-core finds serious or critical on the page as it stands."""
    found = Axe().run(page, options={"resultTypes": ["violations"]}).response["violations"]
    return [
        f"{page.url}: {rule['impact']} {rule['id']} at {rule['nodes'][0]['target']}"
        for rule in found
        if rule["impact"] in ("serious", "critical")
    ]


def in_both_themes(page: Page) -> list[str]:
    """The complaints in light and in dark."""
    found = complaints(page)
    page.get_by_role("button", name="Switch between light and dark").click()
    found += complaints(page)
    page.get_by_role("button", name="Switch between light and dark").click()
    return found


@pytest.mark.slow
def test_axe_finds_nothing_serious_on_any_page_in_either_theme(page: Page, server: Any) -> None:
    found = []
    for path, sign in PAGES.items():
        page.goto(server.url + path)
        expect(page.locator(sign).first).to_be_visible()
        found += in_both_themes(page)
    page.goto(server.url)
    page.locator("#run").click()
    expect(page.locator("#fly[data-status=done]")).to_be_visible()
    expect(page.locator("#report h2").first).to_be_visible()
    found += in_both_themes(page)
    page.set_viewport_size({"width": 390, "height": 844})
    found += in_both_themes(page)
    page.locator("#scene-tab").get_by_text("Replay").click()
    expect(page.locator("#scene iframe[sandbox]")).to_be_visible()
    found += complaints(page)
    assert page.evaluate("document.documentElement.scrollWidth") == 390
    page.set_viewport_size({"width": 1440, "height": 900})
    run_id = page.evaluate("location.pathname").removeprefix("/run/")
    page.goto(f"{server.url}/compare/{run_id}")
    expect(page.locator("#compare-channels-figure .js-line").first).to_be_visible()
    found += in_both_themes(page)
    page.get_by_text("Paths", exact=True).click()
    expect(page.locator("#compare-space canvas").first).to_be_visible()
    found += in_both_themes(page)
    page.goto(f"{server.url}/teach")
    page.get_by_role("button", name="Fly it").click()
    expect(page.locator("#mystery-0 canvas").first).to_be_visible()
    found += in_both_themes(page)
    page.once("dialog", lambda dialog: dialog.accept())
    page.get_by_role("button", name="Give up").click()
    expect(page.locator("#mystery-truth")).to_be_visible()
    found += in_both_themes(page)
    assert found == []


def test_the_tour_is_offered_once_and_is_found_again(
    page: Page, server: Any, console_errors: list[str]
) -> None:
    page.goto(server.url)
    invitation = page.locator("#tour-invitation")
    invitation.get_by_role("button", name="Take the tour").focus()
    page.keyboard.press("Enter")
    card = page.get_by_role("dialog")
    for stop in tour_stops():
        expect(card).to_contain_text(stop.title)
        assert page.locator(".tour-target").count() == 1
        page.keyboard.press("Enter")  # Next has the focus
    expect(card).to_have_count(0)
    expect(invitation).to_be_hidden()
    page.reload()
    expect(page.locator("#tile-0 canvas").first).to_be_visible()
    expect(invitation).to_be_hidden()
    word = page.locator(".term", has_text="Severity")
    word.focus()
    expect(page.get_by_role("tooltip")).to_contain_text(glossary()["severity"].text)
    page.get_by_role("link", name="Help").click()
    expect(page.locator(".words > div")).to_have_count(len(glossary()))
    page.get_by_role("button", name="Take the tour").click()
    expect(card).to_contain_text(tour_stops()[0].title)
    page.keyboard.press("Escape")
    expect(card).to_have_count(0)
    assert page.evaluate("location.pathname") == "/"
    assert console_errors == []


def test_the_wall_shows_the_flight_large_and_heeds_keys(
    page: Page, server: Any, console_errors: list[str]
) -> None:
    page.set_viewport_size({"width": 1920, "height": 1080})
    page.goto(server.url)
    expect(page.locator("#tile-0 canvas").first).to_be_visible()
    page.locator("#run").click()
    expect(page.locator("#fly[data-status=done]")).to_be_visible()
    expect(page.locator("#ranking li").first).to_be_visible()
    page.locator("#run-title").click()
    page.keyboard.press("p")
    expect(page.locator(".area-setup")).to_be_hidden()
    address = page.evaluate("location.pathname")
    assert address.startswith("/present/")
    shown = page.locator(".tile.on-wall")
    assert shown.evaluate_all("all => all.filter(one => one.offsetParent).length") == 12
    sizes = page.evaluate(
        "['#scrub-time', '.rank-share', '.on-wall .tile-readout'].map(one =>"
        " parseFloat(getComputedStyle(document.querySelector(one)).fontSize))"
    )
    assert min(sizes) >= 30, "3 cm on a screen 1.1 m high"
    assert page.evaluate("document.documentElement.dataset.mantineColorScheme") == "dark"
    # The charts take their new height a moment later.
    expect(page.locator("html")).to_have_js_property("scrollHeight", 1080)
    expect(page.locator("html")).to_have_js_property("scrollWidth", 1920)
    # What a class is to find can be hidden, and stays so when the page comes again.
    spoilers = ("#run-title", "#outcome .outcome-line", "#ranking li:first-child")
    for spoiler in spoilers:
        expect(page.locator(spoiler)).to_be_visible()
    page.keyboard.press("h")
    for spoiler in spoilers:
        expect(page.locator(spoiler)).to_be_hidden()
    for _ in range(12):
        page.keyboard.press("ArrowLeft")
    expect(page.locator("#scrub-time")).to_have_text("4:00")
    page.keyboard.press(" ")
    expect(page.locator("#scrub-time")).not_to_have_text("4:00")
    page.keyboard.press(" ")
    page.reload()
    expect(page.locator(".tile.on-wall").first).to_be_visible()
    expect(page.locator(".area-setup")).to_be_hidden()
    expect(page.locator("#wall-hide")).to_be_checked()
    expect(page.locator("#outcome .outcome-line")).to_be_attached()
    for spoiler in spoilers:
        expect(page.locator(spoiler)).to_be_hidden()
    page.keyboard.press("Escape")
    expect(page.locator(".area-setup")).to_be_visible()
    assert page.evaluate("location.pathname") == address.replace("/present/", "/run/")
    assert page.evaluate("document.documentElement.dataset.mantineColorScheme") == "light"
    assert console_errors == []
