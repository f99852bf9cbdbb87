"""The engine monitor, the time cursor's tools and the units, on one page in a real browser."""

import re
import time
from collections.abc import Iterator
from typing import Any

import pytest
from page_modules import in_module
from playwright.sync_api import Locator, Page, expect

from core.diagnosis.predict import load_diagnoser
from core.fmea.fault import Fault
from core.report.case.case import open_case
from core.report.grounded import grounded_template
from core.store.labels import delete
from core.store.store import RunStore
from core.twin.flight import fly_pair
from core.twin.plan import Plan

pytestmark = [pytest.mark.browser, pytest.mark.usefixtures("without_3d")]

TIMEOUT_MS = 120_000
DURATION_S = 300
RPM, CHT1, CHT4, IAS = 9, 10, 13, 19

RANGES = """
() => ["probabilities", "residual-strip"].map((id) => {
  const { xaxis } = document.querySelector(`#${id} .js-plotly-plot`)._fullLayout;
  return xaxis.range.map((end) => Math.round(xaxis.r2l(end) / 1000));
})
"""
"""From when to when the Plotly charts go, in seconds of flight."""


@pytest.fixture(scope="module")
def complaints() -> list[str]:
    return []


@pytest.fixture(scope="module")
def flown(server: Any, browser: Any, complaints: list[str]) -> Iterator[Page]:
    """A page with the default flight flown, looked at by all tests here."""
    page = browser.new_page(viewport={"width": 1440, "height": 1900})
    page.set_default_timeout(TIMEOUT_MS)
    page.on("console", lambda line: complaints.append(line.text) if line.type == "error" else None)
    page.on("pageerror", lambda error: complaints.append(str(error)))
    page.goto(server.url)
    page.locator("#run").click()
    page.locator("#fly[data-status=done]").wait_for()
    expect(page.locator("#moments button")).to_have_count(3, timeout=TIMEOUT_MS)
    yield page
    page.close()


@pytest.fixture
def page_at_rest(flown: Page) -> Page:
    """The page without a cursor, A, B or zoom."""
    flown.mouse.move(2, 2)
    flown.locator("#run-title").click()
    for key in ("Escape", "Escape", "0"):
        flown.keyboard.press(key)
    expect(flown.locator("#zoom-out")).to_be_hidden()
    expect(flown.locator("#engine-time")).to_have_text("at 5:00")
    return flown


def point_at(page: Page, time_s: float, tile: int = RPM) -> None:
    """Put the pointer over a chart where the flight had lasted so long."""
    plot = page.locator(f"#tile-{tile} .u-over").first
    plot.scroll_into_view_if_needed()
    box = plot.bounding_box()
    assert box is not None
    page.mouse.move(box["x"] + box["width"] * time_s / DURATION_S, box["y"] + box["height"] / 2)


def holds(page: Page, condition: str) -> None:
    """Wait for what JavaScript says; not by `wait_for_function`, which our policy lets ask once."""
    deadline = time.monotonic() + 30.0
    while not page.evaluate(condition):
        assert time.monotonic() < deadline, condition
        page.wait_for_timeout(50)


def drag(page: Page, over: Locator, start: float, end: float) -> None:
    """Drag across a chart between two shares of its width."""
    box = over.bounding_box()
    assert box is not None
    y = box["y"] + box["height"] / 2
    page.mouse.move(box["x"] + box["width"] * start, y)
    page.mouse.down()
    page.mouse.move(box["x"] + box["width"] * end, y + 1, steps=4)
    page.mouse.up()


def meter(page: Page, label: str) -> Locator:
    return page.locator(f'[role=meter][aria-label^="{label}"]')


def box_of(locator: Locator) -> dict[str, float]:
    box = locator.bounding_box()
    assert box is not None
    return dict(box)


def reading(page: Page, index: int) -> tuple[float, float]:
    """The reading in the head of a tile, and its difference from the mirror."""
    text = page.locator(f"#readout-{index}").inner_text().replace("−", "-")
    value, difference = text.split("Δ")
    return float(value), float(difference)


def test_the_monitor_shows_each_cylinder_in_its_place(page_at_rest: Page) -> None:
    page = page_at_rest
    expect(page.locator("#engine-view [role=meter]")).to_have_count(18)
    for cylinder in "1234":
        egt, cht = (box_of(meter(page, f"{kind} {cylinder}")) for kind in ("EGT", "CHT"))
        assert egt["y"] + egt["height"] <= cht["y"] + 6
        assert abs(egt["x"] - cht["x"]) < 6
    first, second, third, fourth = (box_of(meter(page, f"EGT {n}")) for n in "1234")
    assert second["x"] < first["x"]  # left and right
    assert fourth["x"] < third["x"]
    assert first["y"] < third["y"]  # front and rear
    assert second["y"] < fourth["y"]


def test_a_bar_and_its_ghost_are_apart_where_the_fault_shows(page_at_rest: Page) -> None:
    def widths(name: str) -> list[float]:
        bars = meter(page_at_rest, name).locator(".fill, .ghost")
        return [
            float(width)
            for width in bars.evaluate_all("all => all.map(b => b.getAttribute('width'))")
        ]

    ill, ghost = widths("CHT 4")
    assert ghost - ill > 3
    well, ghost = widths("CHT 1")
    assert abs(ghost - well) < 1
    value = meter(page_at_rest, "CHT 4").get_attribute("aria-valuenow")
    assert value is not None
    assert float(value) == reading(page_at_rest, CHT4)[0]
    expect(page_at_rest.locator("#engine-status")).to_have_text("Within limits")


def test_all_follow_the_pointer_and_come_back(page_at_rest: Page) -> None:
    page = page_at_rest
    latest = reading(page, CHT4)
    point_at(page, 50.0)
    expect(page.locator("#engine-time")).to_have_text(re.compile("at 0:(49|50|51)"))
    assert reading(page, CHT4)[1] == 0.0
    expect(meter(page, "CHT 4")).to_have_attribute("aria-valuenow", f"{reading(page, CHT4)[0]:.1f}")
    expect(page.locator("#ranking-at")).to_contain_text("Answer at")
    expect(page.locator("#ranking-at li").first).to_contain_text("Nominal")
    expect(page.locator("#ranking")).to_be_hidden()
    point_at(page, 20.0)
    expect(page.locator("#ranking-at")).to_contain_text("No answer yet")
    page.mouse.move(2, 2)
    expect(page.locator("#ranking")).to_be_visible()
    assert reading(page, CHT4) == latest


def test_marks_are_on_every_chart_and_lead_there(page_at_rest: Page) -> None:
    page = page_at_rest
    onset, evidence, named = page.locator("#moments button").all()
    expect(onset).to_have_text("Onset 1:00")
    expect(evidence).to_have_text(re.compile("First evidence: .+ 1:0"))
    expect(named).to_have_text(re.compile("First right answer 1:"))
    for chart in ("probabilities", "residual-strip"):
        for kind in ("evidence", "named"):
            expect(page.locator(f"#{chart} .{kind}-line")).to_be_visible()
    onset.click()
    expect(page.locator("#scrub-time")).to_have_text("1:00")
    expect(page.locator("#engine-time")).to_have_text("at 1:00")
    # A glance elsewhere does not lose the place.
    point_at(page, 200.0)
    expect(page.locator("#scrub-time")).to_have_text(re.compile("3:(19|20|21)"))
    page.mouse.move(2, 2)
    expect(page.locator("#scrub-time")).to_have_text("1:00")


def test_a_to_b_is_measured_in_every_tile(page_at_rest: Page) -> None:
    page = page_at_rest
    point_at(page, 60.0)
    page.keyboard.press("a")
    point_at(page, 240.0)
    page.locator("#set-b").press("Enter")  # by its button: the pointer stays where it is
    expect(page.locator("#between")).to_have_text(re.compile("A 1:0.*B [34]:.*apart"))
    apart = page.locator("#between").inner_text().split("B")[1].split()[1]
    whole, seconds = map(int, apart.split(":"))
    minutes = whole + seconds / 60
    text = page.locator(f"#between-{RPM}").inner_text().replace("−", "-").removeprefix("A→B ")
    gone, rate = (float(part.removesuffix("/min")) for part in text.split())
    assert -70 < gone < -40
    assert rate == pytest.approx(gone / minutes, abs=0.6)
    assert page.locator(".tile-between:not(:empty)").count() == 23
    for chart in ("probabilities", "residual-strip"):
        expect(page.locator(f"#{chart} .a-line")).to_be_visible()
        expect(page.locator(f"#{chart} .b-line")).to_be_visible()
    page.keyboard.press("Escape")
    expect(page.locator("#between")).to_have_text("")
    assert page.locator(".tile-between:not(:empty)").count() == 0


def test_one_zoom_serves_tiles_and_figures(page_at_rest: Page) -> None:
    page = page_at_rest
    tile = page.locator(f"#tile-{RPM} .u-over").first
    tile.scroll_into_view_if_needed()
    drag(page, tile, 0.2, 0.6)
    shown = page.locator("#zoom-out")
    expect(shown).to_contain_text(re.compile("(0:59|1:00|1:01) to (2:59|3:00|3:01)"))
    holds(page, f"({RANGES})().every(([from, to]) => from > 55 && to < 185)")
    page.keyboard.press("+")
    expect(shown).not_to_contain_text("3:0")
    page.keyboard.press("-")
    page.keyboard.press(">")
    expect(shown).not_to_contain_text(re.compile("^[01]:[05]"))
    tile.dblclick()
    expect(shown).to_be_hidden()
    holds(page, f"({RANGES})().every(([from, to]) => from === 0 && to === {DURATION_S})")

    strip = page.locator("#residual-strip .nsewdrag").first
    drag(page, strip, 0.2, 0.6)
    expect(shown).to_be_visible()
    holds(page, f"({RANGES})().every(([from, to]) => from > 40 && to < 200)")
    shown.click()
    expect(shown).to_be_hidden()
    holds(page, f"({RANGES})().every(([from, to]) => from === 0 && to === {DURATION_S})")


LONG = Plan(duration_s=1800.0, seed=4)
SPIKE_ROW, SPIKE_DEGF = 42_000, 480.0
AT_S = SPIKE_ROW / 50


@pytest.fixture
def long_run(server: Any) -> Iterator[str]:
    """A flight of half an hour in the server's store, with a spike of one sample in CHT 1."""
    store, fault = RunStore(server.store), Fault("baffle_crack", 0.8, 300.0)
    pair = fly_pair(LONG, fault)
    pair.faulted.channels[SPIKE_ROW, CHT1] = SPIKE_DEGF
    diagnosis = load_diagnoser().diagnose(pair)
    run_id = store.create(LONG, fault).id
    store.save_pair(run_id, pair)
    store.save_result(run_id, diagnosis, grounded_template(open_case(diagnosis)))
    yield run_id
    delete(store, [run_id])
    store.close()


def test_what_is_zoomed_into_comes_in_finer_samples(
    page: Page, server: Any, long_run: str, console_errors: list[str]
) -> None:
    page.set_default_timeout(TIMEOUT_MS)
    asked: list[str] = []
    page.on("requestfinished", lambda request: asked.append(request.url))
    page.goto(f"{server.url}/run/{long_run}")
    holds(page, in_module("fly/flight.js", "module.flight.count === module.WHOLE"))

    def shown(from_s: float, to_s: float) -> list[float]:
        """What the tile of CHT 1 draws of the faulted flight between two times."""
        drawn = page.evaluate(in_module("fly/flight.js", f"module.rows({CHT1})"))
        return [value for at_s, value in zip(*drawn[:2], strict=True) if from_s <= at_s <= to_s]

    def zoom(half_s: float) -> str:
        return f"module.zoomTo({{ min: {AT_S - half_s}, max: {AT_S + half_s} }})"

    coarse = shown(AT_S - 2, AT_S + 2)
    assert max(coarse) == SPIKE_DEGF
    # On the way through other zooms: only where it comes to rest is asked about.
    page.evaluate(in_module("fly/zoom.js", f"[{', '.join(map(zoom, (300, 60, 2)))}].length"))
    finer = f"module.rows({CHT1})[0].filter((at) => Math.abs(at - {AT_S}) <= 2)"
    holds(page, in_module("fly/flight.js", f"{finer}.length === 201"))
    assert max(shown(AT_S - 2, AT_S + 2)) == SPIKE_DEGF
    assert len([url for url in asked if "/detail?" in url]) == 1
    page.evaluate(in_module("fly/zoom.js", "module.zoomTo(null)"))
    assert shown(AT_S - 2, AT_S + 2) == coarse
    assert console_errors == []


def test_units_are_converted_at_display_and_remembered(
    page_at_rest: Page, complaints: list[str]
) -> None:
    page = page_at_rest
    logged = {index: reading(page, index) for index in (CHT1, CHT4, IAS, RPM)}
    page.locator("#units-chosen").click()
    page.get_by_label("Temperatures in °C").check()
    page.get_by_label("Airspeed in km/h").check()
    page.locator("#units-chosen").click()
    expect(page.locator("#units-chosen")).to_contain_text("°C")

    def check() -> None:
        # Tiles out of view change when the browser has time.
        for index, unit in ((CHT1, "°C"), (CHT4, "°C"), (IAS, "km/h")):
            expect(page.locator(f".tile:has(#tile-{index}) .tile-unit")).to_have_text(unit)
        for index in (CHT1, CHT4):
            value, difference = reading(page, index)
            assert value == pytest.approx((logged[index][0] - 32) / 1.8, abs=0.11)
            assert difference == pytest.approx(logged[index][1] / 1.8, abs=0.11)
        assert reading(page, IAS)[0] == pytest.approx(logged[IAS][0] * 1.852, abs=0.2)
        assert reading(page, RPM) == logged[RPM]
        assert (meter(page, "CHT 4").get_attribute("aria-valuetext") or "").endswith("°C")

    check()
    page.reload()
    expect(page.locator("#moments button")).to_have_count(3, timeout=TIMEOUT_MS)
    expect(page.locator("#engine-time")).to_have_text("at 5:00", timeout=TIMEOUT_MS)
    check()
    assert complaints == []


SCRUB = """
async () => {
  const over = document.querySelector("#tile-9 .u-over");
  const { left, width, top } = over.getBoundingClientRect();
  const frames = [];
  const begun = performance.now();
  return await new Promise((done) => {
    const step = (now) => {
      frames.push(now);
      const share = ((now - begun) % 1500) / 1500;
      over.dispatchEvent(new MouseEvent("mousemove", {
        bubbles: true, clientX: left + share * width, clientY: top + 20,
      }));
      if (now - begun < 3000) requestAnimationFrame(step);
      else done(frames);
    };
    requestAnimationFrame(step);
  });
}
"""


@pytest.mark.slow
def test_scrubbing_costs_little_of_a_frame(page_at_rest: Page, record_property: Any) -> None:
    """At 20 frames a second a frame has 50 ms. CPU time: a busy machine does not count."""
    page = page_at_rest
    page.set_viewport_size({"width": 1440, "height": 900})
    page.evaluate("document.querySelectorAll('#scene iframe').forEach((frame) => frame.remove())")
    page.locator(f"#tile-{RPM}").scroll_into_view_if_needed()
    session = page.context.new_cdp_session(page)
    session.send("Performance.enable", {"timeDomain": "threadTicks"})

    def spent_s() -> float:
        metrics = session.send("Performance.getMetrics")["metrics"]
        kinds = ("ScriptDuration", "LayoutDuration", "RecalcStyleDuration")
        return float(sum(each["value"] for each in metrics if each["name"] in kinds))

    before_s = spent_s()
    frames = page.evaluate(SCRUB)
    frame_ms = 1000 * (spent_s() - before_s) / (len(frames) - 1)
    rate = 1000 * (len(frames) - 1) / (frames[-1] - frames[0])
    record_property("frame_cpu_ms", round(frame_ms, 1))
    record_property("frames_per_s", round(rate, 1))
    print(f"{frame_ms:.1f} ms of CPU a frame while scrubbing, {rate:.0f} frames/s")
    assert frame_ms < 30
