"""Elapsed time in every time zone: a flight begins at 0:00 wherever its reader sits."""

import re
from collections.abc import Callable, Iterator
from typing import Any

import pytest
from page_modules import in_module
from playwright.sync_api import BrowserContext, FloatRect, Locator, Page, expect

from app.figures.axes import time_axis
from core.diagnosis.predict import load_diagnoser
from core.fmea.fault import Fault
from core.report.case.case import open_case
from core.report.grounded import grounded_template
from core.store.store import RunStore
from core.twin.flight import fly_pair
from core.twin.plan import Plan

pytestmark = pytest.mark.browser

TIMEOUT_MS = 120_000
ZONES = ("UTC", "Asia/Kolkata", "America/St_Johns", "America/New_York")
CHARTS = ("#probabilities", "#residual-strip")

Open = Callable[..., Page]


@pytest.fixture(scope="module")
def run_id(server: Any) -> Iterator[str]:
    """A stored flight of 300 s with a fault from 60 s on."""
    store = RunStore(server.store)
    plan, fault = Plan(seed=11), Fault("baffle_crack", 0.8, 60.0)
    pair = fly_pair(plan, fault)
    diagnosis = load_diagnoser().diagnose(pair)
    name = store.create(plan, fault).id
    store.save_pair(name, pair)
    store.save_result(name, diagnosis, grounded_template(open_case(diagnosis)))
    store.close()
    return name


@pytest.fixture
def open_in(new_context: Callable[..., BrowserContext], server: Any) -> Open:
    """Open a page of the server as a reader in that zone sees it."""

    def opened(zone: str, path: str) -> Page:
        context = new_context(timezone_id=zone, viewport={"width": 1440, "height": 1600})
        context.set_default_timeout(TIMEOUT_MS)
        context.route(
            "**/viser/**",
            lambda route: route.fulfill(body="<!doctype html>", content_type="text/html"),
        )
        page = context.new_page()
        page.goto(server.url + path, timeout=TIMEOUT_MS)
        return page

    return opened


def settled(locator: Locator) -> FloatRect:
    """Where something is once it is where it was a moment ago: the report moves what is below."""
    before = None
    while (box := locator.bounding_box()) != before or box is None:
        before = box
        locator.page.wait_for_timeout(100)
    return box


def ticks(page: Page, chart: str) -> list[str]:
    """The texts along the time axis of a chart, in order."""
    texts = page.locator(f"{chart} .xtick text")
    expect(texts.first).to_be_visible(timeout=TIMEOUT_MS)
    return texts.all_text_contents()


def open_run(open_in: Open, zone: str, run_id: str) -> Page:
    page = open_in(zone, f"/run/{run_id}")
    page.locator("#fly[data-status=done]").wait_for()
    page.locator("#tile-0[data-samples]:not([data-samples='0'])").wait_for()
    for chart in CHARTS:
        page.locator(f"{chart} .onset-line, {chart} .time-lines").first.wait_for(state="attached")
    return page


@pytest.mark.parametrize("zone", ZONES)
def test_axes_cursor_and_zoom_count_from_the_start_of_the_flight(
    open_in: Open, run_id: str, zone: str
) -> None:
    page = open_run(open_in, zone, run_id)
    for chart in CHARTS:
        assert ticks(page, chart) == ["0:00", "1:00", "2:00", "3:00", "4:00", "5:00"]

    # Pointing: the middle of the strip is the middle of the flight, and its line stands there.
    strip = page.locator("#residual-strip .nsewdrag")
    strip.scroll_into_view_if_needed()
    area = settled(strip)
    middle = area["y"] + area["height"] / 2
    page.mouse.move(area["x"] + area["width"] / 2, middle)
    expect(page.locator("#scrub-time")).to_have_text("2:30", timeout=TIMEOUT_MS)
    cursor_s = float(page.locator("#tile-9").get_attribute("data-cursor-s") or "nan")
    assert cursor_s == pytest.approx(150.0, abs=0.5)
    line = page.locator("#residual-strip .cursor-line").bounding_box()
    assert line is not None
    assert line["x"] == pytest.approx(area["x"] + area["width"] / 2, abs=2)
    # The strip is of bins of 2 s, and Plotly names the middle of one.
    expect(page.locator("#residual-strip .hoverlayer")).to_contain_text(
        re.compile(r"at 2:(29|31)\.0")
    )
    page.keyboard.press("a")
    expect(page.locator("#between")).to_have_text("A 2:30")

    # Zooming by hand on a Plotly chart: all follow, and none shows another part of the flight.
    page.evaluate("window.zooms = []")
    follow = "module.zoomChanged.listen((zoom) => zooms.push(zoom))"
    page.evaluate(in_module("fly/changes.js", follow))
    page.mouse.move(area["x"] + area["width"] / 5, middle)
    page.mouse.down()
    page.mouse.move(area["x"] + area["width"] * 2 / 5, middle, steps=5)
    page.mouse.up()
    span = re.compile("^(0:5[89]|1:00) to (1:5[89]|2:00)")
    expect(page.locator("#zoom-out")).to_have_text(span)
    zoom = page.evaluate("zooms.at(-1)")
    assert (zoom["min"], zoom["max"]) == pytest.approx((60.0, 120.0), abs=2.0)  # a pixel
    for chart in CHARTS:
        expect(page.locator(f"{chart} .xtick text").first).to_have_text("1:00")
        shown = ticks(page, chart)
        assert len(shown) > 3 and all(re.fullmatch(r"[12]:\d\d", text) for text in shown), shown

    # And the other way round: a chart follows a zoom by key.
    page.keyboard.press("0")
    expect(page.locator("#zoom-out")).to_be_hidden()
    for chart in CHARTS:
        expect(page.locator(f"{chart} .xtick text").first).to_have_text("0:00")

    # Hours, of a flight longer than this test can fly.
    page.evaluate(
        """(xaxis) => {
            const place = Object.assign(document.createElement("div"), { id: "long" });
            document.body.append(place);
            return Plotly.newPlot(place, [], { width: 900, height: 200, xaxis });
        }""",
        time_axis(7200.0),
    )
    hours = ticks(page, "#long")
    assert (hours[0], hours[-1]) == ("0:00:00", "2:00:00")
    page.context.close()


def test_the_other_pages_count_from_the_start_too(open_in: Open, run_id: str) -> None:
    page = open_in("Asia/Kolkata", f"/compare/{run_id}")
    shown = ticks(page, "#compare-channels-figure")
    assert (shown[0], shown[-1]) == ("0:00", "5:00")
    area = page.locator("#compare-channels-figure .nsewdrag").first.bounding_box()
    assert area is not None
    page.mouse.move(area["x"] + area["width"] / 2, area["y"] + area["height"] / 2)
    hover = page.locator("#compare-channels-figure .hoverlayer")
    expect(hover).to_contain_text("2:30", timeout=TIMEOUT_MS)

    page.goto(page.url.split("/compare")[0] + "/faults/baffle_crack")
    page.locator(".js-plotly-plot .xtick text").first.scroll_into_view_if_needed()
    shown = ticks(page, ".js-plotly-plot >> nth=0 >>")
    assert shown[0] == "0:00"
    page.context.close()
