"""The page Fly in a real browser, on a server started as a user starts it."""

import io
import re
import signal
import subprocess
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import psutil
import pytest
from PIL import Image
from playwright.sync_api import BrowserContext, Page, Route, expect

from app import theme
from core.channels import N_CHANNELS
from core.paths import MODELS
from core.report.sections import SECTION_TITLES

pytestmark = pytest.mark.browser
without_3d = pytest.mark.usefixtures("without_3d")

TIMEOUT_MS = 120_000


@dataclass
class Fly:
    """The page, as a user handles it."""

    page: Page
    url: str

    def open(self, path: str = "/") -> "Fly":
        self.page.goto(self.url + path)
        expect(self.page.locator("#run")).to_be_visible(timeout=TIMEOUT_MS)
        # The first tile is drawn once the page is live.
        expect(self.page.locator("#tile-0 canvas").first).to_be_visible(timeout=TIMEOUT_MS)
        return self

    def fill(self, field: str, value: str) -> None:
        box = self.page.locator(f"#field-{field}")
        box.fill(value)
        box.blur()

    def choose_fault(self, name: str) -> None:
        box = self.page.locator("#field-fault")
        box.click()
        box.fill(name)
        self.page.get_by_role("option", name=name, exact=True).click()

    def press(self, name: str) -> None:
        self.page.locator(f"#{name}").click()

    def wait(self, *statuses: str) -> str:
        choice = ", ".join(f"#fly[data-status={status}]" for status in statuses)
        self.page.locator(choice).wait_for(timeout=TIMEOUT_MS)
        return self.status

    @property
    def status(self) -> str:
        return self.page.locator("#fly").get_attribute("data-status") or ""

    @property
    def run_id(self) -> str:
        return self.page.evaluate("location.pathname").removeprefix("/run/")

    @property
    def samples(self) -> list[int]:
        """Samples drawn in each of the 23 tiles."""
        return self.page.evaluate(
            "[...document.querySelectorAll('.tile-chart')].map(tile => +tile.dataset.samples || 0)"
        )

    def wait_for_samples(self) -> None:
        drawn = self.page.locator(".tile-chart[data-samples]:not([data-samples='0'])")
        drawn.first.wait_for(timeout=TIMEOUT_MS)

    def wait_for_all_tiles(self) -> None:
        """Tiles out of view are drawn when the browser has time."""
        deadline = time.monotonic() + TIMEOUT_MS / 1000
        while min(self.samples) <= 300:
            assert time.monotonic() < deadline, f"samples drawn by tile: {self.samples}"
            time.sleep(0.1)

    def text(self, element: str) -> str:
        return self.page.locator(f"#{element}").inner_text()

    def picture(self, selector: str) -> np.ndarray:
        """What is on screen there, (height, width, 3)."""
        target = self.page.locator(selector)
        target.scroll_into_view_if_needed()
        box = target.bounding_box()
        assert box is not None
        image = Image.open(io.BytesIO(self.page.screenshot(clip=box)))
        return np.asarray(image.convert("RGB"), dtype=np.int16)

    def picture_at_rest(self, selector: str) -> np.ndarray:
        """What is on screen there once it is drawn and changes no more."""
        deadline = time.monotonic() + TIMEOUT_MS / 1000
        before = self.picture(selector)
        while True:
            time.sleep(0.5)
            now = self.picture(selector)
            if now.std() > 1.0 and np.array_equal(now, before):
                return now
            assert time.monotonic() < deadline, f"{selector} does not come to rest"
            before = now


@pytest.fixture
def fly(page: Page, server: Any) -> Fly:
    page.set_viewport_size({"width": 1440, "height": 900})
    return Fly(page, server.url)


def has_colour(picture: np.ndarray, colour: str, least: int) -> bool:
    wanted = np.array([int(colour[at : at + 2], 16) for at in (1, 3, 5)])
    return int((np.abs(picture - wanted).max(axis=2) < 40).sum()) >= least


def test_one_click_shows_a_fault_fly_and_its_report(
    fly: Fly, console_errors: list[str], record_property: Callable[[str, object], None]
) -> None:
    fly.open()
    time.sleep(3)  # the 3D view has its own start
    empty = fly.picture("#scene")
    fly.press("run")
    fly.wait("done")
    expect(fly.page.locator("#report h2")).to_have_count(len(SECTION_TITLES))

    assert fly.page.locator("#report h2").all_inner_texts() == list(SECTION_TITLES)
    assert "Cylinder compression" in fly.text("report")
    assert "Cylinder compression" in fly.page.locator("#ranking li").first.inner_text()
    assert len(fly.samples) == N_CHANNELS
    fly.wait_for_all_tiles()
    for index in range(N_CHANNELS):
        readout = fly.text(f"readout-{index}")
        assert "Δ" in readout, f"channel {index}: {readout!r}"
    time.sleep(2)
    flown = fly.picture("#scene")
    assert (np.abs(flown - empty).max(axis=2) > 24).mean() > 0.01
    assert console_errors == []


def worker_processes(server: "subprocess.Popen[bytes]") -> list[psutil.Process]:
    children = psutil.Process(server.pid).children(recursive=True)
    return [child for child in children if "spawn_main" in " ".join(child.cmdline())]


@contextmanager
def held(server: "subprocess.Popen[bytes]") -> Iterator[None]:
    """Stop the workers where they are, so that no flight ends meanwhile."""
    workers = worker_processes(server)
    for worker in workers:
        worker.suspend()
    try:
        yield
    finally:
        for worker in workers:
            with suppress(psutil.NoSuchProcess):
                worker.resume()


def cpu_s(process: psutil.Process) -> float:
    """The CPU time that a process has used, in seconds."""
    times = process.cpu_times()
    return float(times.user + times.system)


def wait_until_idle(workers: list[psutil.Process]) -> None:
    """Return once no worker has used a tenth of a core for half a second."""
    deadline = time.monotonic() + TIMEOUT_MS / 1000
    while time.monotonic() < deadline:
        before_s = sum(map(cpu_s, workers))
        time.sleep(0.5)
        if sum(map(cpu_s, workers)) - before_s < 0.05:
            return
    pytest.fail("the workers are never idle")


LINES = {"faulted": theme.FAULTED, "mirror": theme.MIRROR, "residual": theme.RESIDUAL}


@without_3d
def test_each_tile_draws_both_flights_and_their_residual(fly: Fly) -> None:
    fly.open()
    fly.press("run")
    fly.wait("done")
    time.sleep(1)
    for index in range(N_CHANNELS):
        tile = fly.picture(f"#tile-{index}")
        for name, colour in (
            ("faulted", "#2f81d8"),
            ("mirror", "#97a3b0"),
            ("residual", "#b455c9"),
        ):
            assert has_colour(tile, colour, 40), f"channel {index}: no {name} line"


@without_3d
def test_the_address_brings_the_run_back_here_and_in_another_browser(
    fly: Fly, new_context: Callable[..., BrowserContext]
) -> None:
    fly.open()
    fly.choose_fault("Engine failure")
    fly.press("run")
    fly.page.wait_for_url("**/run/*")
    address = f"/run/{fly.run_id}"
    fly.wait("done")
    report = fly.text("report")

    fly.open(address)
    fly.wait("done")
    expect(fly.page.locator("#report")).to_have_text(report, use_inner_text=True)

    other = Fly(new_context().new_page(), fly.url).open(address)
    other.wait("done")
    expect(other.page.locator("#report")).to_have_text(report, use_inner_text=True)
    other.page.locator("#tile-22[data-samples]:not([data-samples='0'])").wait_for()
    assert other.page.locator("#field-fault").input_value() == "Engine failure"
    assert "Engine failure" in other.text("run-title")


def test_reload_in_the_middle_of_a_run_goes_on_with_it(fly: Fly, server: Any) -> None:
    fly.open()
    fly.fill("duration_s", "1200")
    fly.press("run")
    fly.page.wait_for_url("**/run/*")
    fly.wait_for_samples()
    address = f"/run/{fly.run_id}"
    with held(server.process):
        drawn = max(fly.samples)
        fly.open(address)
        fly.wait("running")
        fly.wait_for_samples()
        assert 0 < drawn <= max(fly.samples) < 1500
        assert "of 20:00" in fly.text("stage")
    fly.wait("done")
    assert fly.run_id == address.removeprefix("/run/")


@without_3d
@pytest.mark.skipif(
    not (MODELS / "cnn-surrogate-lab.safetensors").exists(), reason="no surrogate model shipped"
)
def test_residuals_can_be_taken_against_the_surrogate(fly: Fly, console_errors: list[str]) -> None:
    fly.open()
    switch = fly.page.locator("#residual-switch")
    expect(switch.locator("input").first).to_be_disabled()
    fly.press("run")
    fly.wait("done")
    mirror = fly.text("ranking")
    switch.get_by_text("Surrogate").click()
    ranking = expect(fly.page.locator("#ranking"))
    ranking.not_to_have_text(mirror, use_inner_text=True, timeout=TIMEOUT_MS)
    assert len(fly.text("ranking")) > 20
    switch.get_by_text("Mirror").click()
    ranking.to_have_text(mirror, use_inner_text=True, timeout=TIMEOUT_MS)
    assert fly.page.locator("#alert").inner_text() == ""
    assert console_errors == []


def test_one_cursor_serves_all_charts_and_the_aircraft(fly: Fly, console_errors: list[str]) -> None:
    fly.page.set_viewport_size({"width": 1440, "height": 2200})  # scene and tile in one view
    fly.page.set_default_timeout(TIMEOUT_MS)
    fly.open()
    fly.press("run")
    fly.wait("done")
    expect(fly.page.locator("#report h2")).to_have_count(len(SECTION_TITLES), timeout=TIMEOUT_MS)
    fly.wait_for_all_tiles()
    readouts = [fly.text(f"readout-{index}") for index in (9, 13)]
    latest = fly.picture_at_rest("#scene")
    plot = fly.page.locator("#tile-9 .u-over").first
    box = plot.bounding_box()
    assert box is not None
    # One sixth of 300 s is before the onset: nothing differs there.
    plot.hover(position={"x": box["width"] / 6, "y": box["height"] / 2})
    time_shown = fly.page.locator("#scrub-time")
    expect(time_shown).to_have_text(re.compile("00:(49|50|51)"), timeout=TIMEOUT_MS)
    assert fly.text("readout-9") != readouts[0] and "Δ +0" in fly.text("readout-9")
    assert fly.text("readout-13") != readouts[1]
    expect(fly.page.locator("#probabilities .cursor-line")).to_be_visible(timeout=TIMEOUT_MS)
    expect(fly.page.locator("#residual-strip .cursor-line")).to_be_visible(timeout=TIMEOUT_MS)
    deadline = time.monotonic() + TIMEOUT_MS / 1000
    while (np.abs(fly.picture("#scene") - latest).max(axis=2) > 24).mean() <= 0.002:
        assert time.monotonic() < deadline, "the aircraft stay where they were"

    fly.page.locator("#scrub [role=slider]").focus()
    fly.page.keyboard.press("End")
    expect(time_shown).to_have_text("5:00", timeout=TIMEOUT_MS)
    fly.page.keyboard.press("Home")
    expect(time_shown).to_have_text("0:00", timeout=TIMEOUT_MS)
    fly.page.locator("#play-speed").get_by_text("×60").click()
    fly.press("play")
    # Playing may be over before it is looked at.
    expect(time_shown).to_have_text("5:00", timeout=TIMEOUT_MS)
    expect(fly.page.locator("#play")).to_have_attribute(
        "aria-label", "Play the flight", timeout=TIMEOUT_MS
    )
    assert console_errors == []


@without_3d
def test_a_chart_that_comes_after_its_flight_has_the_cursor_too(fly: Fly) -> None:
    fly.open()
    fly.fill("duration_s", "60")
    fly.fill("onset_s", "20")
    fly.press("run")
    fly.wait("done")
    # As on a busy machine: Plotly arrives when the flight has long been drawn.
    late: list[Route] = []
    fly.page.route(re.compile("async-graph"), lambda route: late.append(route))
    fly.page.reload()
    fly.wait("done")
    fly.wait_for_samples()
    for route in late:
        route.continue_()
    strip = fly.page.locator("#residual-strip .nsewdrag")
    strip.hover(timeout=TIMEOUT_MS)
    expect(fly.page.locator("#scrub-time")).to_have_text(re.compile("00:(29|30|31)"))
    expect(fly.page.locator("#probabilities .cursor-line")).to_be_visible()


@without_3d
def test_a_slider_that_is_set_late_does_not_move_the_cursor_back(fly: Fly) -> None:
    fly.open()
    fly.fill("duration_s", "60")
    fly.fill("onset_s", "20")
    fly.press("run")
    fly.wait("done")
    fly.wait_for_samples()
    # As on a busy machine: what the page sets of itself comes after the next key.
    fly.page.evaluate(
        """() => {
            const set = dash_clientside.set_props;
            window.late = 0;
            dash_clientside.set_props = (...given) => setTimeout(() => {
                set(...given);
                setTimeout(() => { window.late += 1; }, 100);
            }, 1000);
        }"""
    )
    slider = fly.page.locator("#scrub [role=slider]")
    slider.focus()
    for key, shown in (("End", "1:00"), ("Home", "0:00"), ("ArrowRight", "0:01")):
        fly.page.keyboard.press(key)
        expect(fly.page.locator("#scrub-time")).to_have_text(shown)
    fly.page.evaluate("new Promise((later) => setTimeout(later, 2500))")
    assert fly.page.evaluate("late") > 0, "the aircraft are moved by what is set"
    assert fly.text("scrub-time") == "0:01"
    expect(slider).to_have_attribute("aria-valuenow", "1")


@without_3d
def test_leaving_the_page_leaves_nothing_behind_that_fails(
    fly: Fly, console_errors: list[str]
) -> None:
    fly.open()
    fly.fill("duration_s", "60")
    fly.fill("onset_s", "20")
    fly.press("run")
    fly.wait("done")
    fly.wait_for_samples()
    for _ in range(3):
        fly.press("play")
        fly.page.locator("#tile-0 .u-over").first.hover()
        fly.page.keyboard.press("+")
        fly.page.locator("#nav-runs").click()
        expect(fly.page.locator(".runs-page")).to_be_visible()
        # What was under way at that moment on a slower machine: its timers end before this one.
        fly.page.evaluate("dash_clientside.cursor.move(30)")
        fly.page.evaluate("new Promise((later) => setTimeout(later, 600))")
        assert console_errors == []
        fly.page.go_back()
        fly.wait("done")
        fly.wait_for_samples()


def test_two_browsers_with_two_faults_see_each_its_own(
    fly: Fly, new_context: Callable[..., BrowserContext]
) -> None:
    other = Fly(new_context(viewport={"width": 1440, "height": 900}).new_page(), fly.url)
    fly.open()
    other.open()
    fly.choose_fault("Baffle crack")
    other.choose_fault("Engine overspeed")
    fly.press("run")
    other.press("run")
    for one, mine, theirs in (
        (fly, "Baffle crack", "Engine overspeed"),
        (other, "Engine overspeed", "Baffle crack"),
    ):
        one.wait("done")
        expect(one.page.locator("#report h2")).to_have_count(len(SECTION_TITLES))
        assert mine in one.text("run-title")
        assert theirs not in one.text("run-title")
    assert fly.run_id != other.run_id
    frames = [one.page.locator("#scene iframe").get_attribute("src") for one in (fly, other)]
    assert frames[0] != frames[1]
    expect(other.page.locator("#readout-9")).not_to_have_text(fly.text("readout-9"))


@without_3d
def test_a_run_can_be_cancelled_and_flown_again(fly: Fly, server: Any) -> None:
    fly.open()
    with held(server.process):
        fly.press("run")
        fly.press("cancel")
        fly.wait("cancelled")
    cancelled = fly.run_id
    fly.fill("duration_s", "60")
    fly.fill("onset_s", "20")
    fly.press("run")
    fly.wait("done")
    first = fly.run_id
    assert first != cancelled
    fly.press("again")
    expect(fly.page).not_to_have_url(f"{fly.url}/run/{first}")
    fly.wait("done")
    assert fly.run_id not in (first, cancelled)
    assert "1:00 long" in fly.text("run-subtitle")


def test_what_cannot_be_flown_is_said_at_its_field(fly: Fly, console_errors: list[str]) -> None:
    fly.open()
    fly.fill("altitude_ft", "90000")
    fly.press("run")
    message = fly.page.locator("#field-altitude_ft-error, .mantine-InputWrapper-error").first
    expect(message).to_contain_text("2000 to 9000 ft", timeout=TIMEOUT_MS)
    assert fly.status == "idle"
    fly.fill("altitude_ft", "5000")
    fly.fill("onset_s", "400")
    fly.press("run")
    expect(fly.page.locator(".mantine-InputWrapper-error")).to_contain_text("before the end")
    fly.fill("onset_s", "20")
    fly.fill("duration_s", "60")
    fly.press("run")
    fly.wait("done")
    expect(fly.page.locator(".mantine-InputWrapper-error")).to_have_count(0)
    assert console_errors == []


def test_an_address_of_no_run_says_so(fly: Fly) -> None:
    for name in ("nonsense", "20261123T061500-k3x9q2wz"):
        answer = fly.page.goto(f"{fly.url}/run/{name}")
        assert answer is not None
        assert answer.status == 404
        page = fly.page.locator("#page")
        expect(page).to_contain_text(name)
        expect(page.get_by_role("link", name="Fly a new flight")).to_be_visible()
        assert "Traceback" not in page.inner_text()
    fly.page.get_by_role("link", name="Fly a new flight").click()
    expect(fly.page.locator("#run")).to_be_visible()


@without_3d
def test_the_keyboard_is_enough(fly: Fly) -> None:
    fly.open()
    fly.page.locator("#field-altitude_ft").focus()
    fly.page.keyboard.press("Control+a")
    fly.page.keyboard.type("6500")
    order = []
    for _ in range(3):
        fly.page.keyboard.press("Tab")
        order.append(fly.page.evaluate("document.activeElement.id"))
    assert order == ["field-speed_kt", "field-heading_deg", "field-duration_s"]
    fly.page.keyboard.press("Control+a")
    fly.page.keyboard.type("90")
    fly.page.keyboard.press("Control+Enter")
    fly.wait("done")
    assert "6,500 ft" in fly.text("run-subtitle")
    assert "1:30 long" in fly.text("run-subtitle")


@without_3d
def test_stored_runs_are_listed_and_open(fly: Fly, console_errors: list[str]) -> None:
    fly.open()
    fly.fill("duration_s", "60")
    fly.fill("onset_s", "20")
    fly.fill("seed", "4242")
    fly.press("run")
    fly.wait("done")
    run_id = fly.run_id
    fly.page.locator("#nav-runs").click()
    row = fly.page.locator(f".ag-center-cols-container .ag-row[row-id='{run_id}']")
    expect(row).to_contain_text("Done")
    row.get_by_role("link").first.click()
    fly.page.wait_for_url(f"**/run/{run_id}")
    fly.wait("done")
    fly.page.go_back()
    expect(fly.page.locator(".runs-page")).to_be_visible()
    assert console_errors == []


def test_the_theme_follows_the_system_until_it_is_chosen(
    fly: Fly, new_context: Callable[..., BrowserContext]
) -> None:
    dark = Fly(new_context(color_scheme="dark").new_page(), fly.url).open()
    html = dark.page.locator("html")
    expect(html).to_have_attribute("data-mantine-color-scheme", "dark")
    dark.page.get_by_label("Switch between light and dark").click()
    expect(html).to_have_attribute("data-mantine-color-scheme", "light")
    dark.open()
    expect(html).to_have_attribute("data-mantine-color-scheme", "light")


def test_the_recording_opens_in_the_replay_tab(fly: Fly) -> None:
    fly.open()
    fly.fill("duration_s", "120")
    fly.press("run")
    fly.wait("done")
    fly.page.locator("#scene-tab").get_by_text("Replay").click()
    frame = fly.page.locator("#scene iframe")
    expect(frame).to_have_count(1)
    expect(frame).to_have_attribute("sandbox", "allow-scripts")
    assert fly.run_id in (frame.get_attribute("src") or "")
    deadline = time.monotonic() + TIMEOUT_MS / 1000
    while not has_colour(fly.picture("#scene"), theme.FAULTED, 60):
        assert time.monotonic() < deadline, "the replay shows no faulted aircraft"
        time.sleep(1)


@pytest.mark.slow
def test_a_killed_worker_is_told_and_the_run_goes_on(
    page: Page, start_server: Callable[..., Any], console_errors: list[str]
) -> None:
    server = start_server()
    fly = Fly(page, server.url).open()
    fly.fill("duration_s", "1200")
    workers = worker_processes(server.process)
    wait_until_idle(workers)  # or the other one, still warming up, would pass for the busy one
    idle_s = {worker: cpu_s(worker) for worker in workers}
    fly.press("run")
    fly.wait_for_samples()
    with held(server.process):
        flying = max(workers, key=lambda worker: cpu_s(worker) - idle_s[worker])
        flying.send_signal(signal.SIGKILL)
    expect(fly.page.locator("#alert")).to_contain_text("attempt 2", timeout=TIMEOUT_MS)
    fly.wait("done")
    fly.wait_for_all_tiles()
    assert console_errors == []


@without_3d
@pytest.mark.slow
def test_a_store_that_cannot_be_written_is_told(
    page: Page, start_server: Callable[..., Any], tmp_path: Path
) -> None:
    store = tmp_path / "store"
    server = start_server(store=store)
    fly = Fly(page, server.url).open()
    if (store / "runs").is_dir():
        (store / "runs").rmdir()
    (store / "runs").write_text("in the way: no folder can be made here")
    fly.fill("duration_s", "60")
    fly.fill("onset_s", "20")
    fly.press("run")
    fly.wait("failed")
    expect(fly.page.locator("#alert")).to_contain_text("store")
    assert "Traceback" not in fly.text("alert")
    (store / "runs").unlink()
    fly.press("retry")
    fly.wait("done")
    expect(fly.page.locator("#alert")).to_be_empty()


@pytest.mark.slow
def test_from_another_machine_the_link_opens_everything(
    page: Page,
    new_context: Callable[..., BrowserContext],
    start_server: Callable[..., Any],
    monkeypatch: pytest.MonkeyPatch,
    console_errors: list[str],
) -> None:
    monkeypatch.setenv("MIRRORTWIN_TOKEN", "a-token-for-tests-only")
    server = start_server("--host", "0.0.0.0")
    printed = server.log.read_text().split()
    shown = next(word for word in printed if word.startswith("http://"))
    assert shown.endswith("/?token=a-token-for-tests-only")
    fly = Fly(page, shown.split("/?")[0])
    fly.open("/?token=a-token-for-tests-only")
    assert "token" not in page.url
    fly.press("run")
    fly.wait("done")
    page.locator("#scene-tab").get_by_text("Replay").click()
    viewer = page.frame_locator("#scene iframe")
    expect(viewer.locator("canvas").first).to_be_visible(timeout=TIMEOUT_MS)
    assert console_errors == []

    stranger = new_context().new_page()
    answer = stranger.goto(page.url)
    assert answer is not None and answer.status == 401
    assert "?token=" in stranger.inner_text("body")
