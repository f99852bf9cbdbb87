"""Both 3D viewers, drawn by a real Chromium, embedded as the page embeds them.

What is asked is whether the flights are seen: pixels in their colours, against an empty scene.
"""

import io
import secrets
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from urllib.parse import quote

import numpy as np
import pytest
from fastapi import FastAPI
from fastapi.responses import HTMLResponse
from numpy.typing import NDArray
from PIL import Image
from playwright.sync_api import Frame, Page

from app.scenes.palette import FAULTED, MIRROR, Rgb
from app.scenes.recordings import Recordings, write_recording
from app.scenes.rerun_viewer import VERSION
from app.scenes.viser_proxy import ViserScenes
from core.fmea.fault import Fault
from core.jobs.events import SAMPLE_STRIDE, Samples
from core.store.store import RunStore
from core.twin.flight import fly_pair
from core.twin.plan import Plan
from core.twin.trajectory import Pair

pytestmark = [pytest.mark.browser, pytest.mark.slow]

PATIENCE_S = 60.0
SIZE = {"width": 760, "height": 420}
PLAN = Plan(heading_deg=200.0, duration_s=120.0, seed=5)
FAULT = Fault("engine_failure", severity=0.8, onset_s=40.0)

Pixels = NDArray[np.int16]


@dataclass(frozen=True)
class Site:
    """A server with both viewers, and a page that frames whatever it is told."""

    url: str
    scenes: ViserScenes
    recordings: Recordings
    store: RunStore

    def frame(self, page: Page, address: str, *, sandbox: bool) -> Frame:
        """Show an address of this site in an iframe that fills ``page``."""
        page.set_viewport_size(SIZE)  # type: ignore[arg-type]  # a TypedDict of these two
        page.goto(f"{self.url}/framed?sandbox={int(sandbox)}&address={quote(address)}")
        wait(lambda: len(page.frames) == 2 and address in page.frames[1].url)
        return page.frames[1]


_FRAMED = """<!DOCTYPE html><html><head><link rel="icon" href="data:,">
<style>body {{ margin: 0 }} iframe {{ border: 0; width: 100vw; height: 100vh; display: block }}
</style></head><body><iframe id="frame" {sandbox}></iframe><script>
window.told = [];
addEventListener("message", (event) => window.told.push(event.data.type));
document.getElementById("frame").src = new URLSearchParams(location.search).get("address");
</script></body></html>"""


@pytest.fixture(scope="module")
def pair() -> Pair:
    """An engine failure: both paths part for good."""
    return fly_pair(PLAN, FAULT)


@pytest.fixture
def site(tmp_path: Path, serve_app: Any) -> Iterator[Site]:
    """A site of the test's own."""
    app = FastAPI()
    store = RunStore(tmp_path / "store")
    scenes, recordings = ViserScenes(), Recordings(store)
    scenes.mount(app)
    recordings.mount(app)

    @app.get("/framed")
    def framed(sandbox: int) -> HTMLResponse:
        return HTMLResponse(_FRAMED.format(sandbox='sandbox="allow-scripts"' if sandbox else ""))

    with serve_app(lambda port: app, timeout_graceful_shutdown=2) as url:
        yield Site(url, scenes, recordings, store)
        scenes.close_all()
    store.close()


def wait(condition: Callable[[], Any], what: str = "the page") -> None:
    """Wait until something holds; the viewers' CSP forbids Playwright's own way of waiting."""
    deadline = time.monotonic() + PATIENCE_S
    while not condition():
        assert time.monotonic() < deadline, f"waited in vain for {what}"
        time.sleep(0.1)


def picture(page: Page) -> Pixels:
    """What is on the screen, (height, width, 3)."""
    png = page.screenshot()  # not of the frame: that would wait for it to stand still
    return np.asarray(Image.open(io.BytesIO(png)).convert("RGB"), dtype=np.int16)


def like(pixels: Pixels, colour: Rgb, tolerance: int = 30) -> int:
    """How many pixels are of about that colour."""
    return int(np.sum(np.abs(pixels - np.array(colour)).max(axis=2) < tolerance))


def changed(before: Pixels, after: Pixels) -> float:
    """The share of pixels that differ visibly."""
    return float(np.mean(np.abs(before - after).max(axis=2) > 12))


def streamed(pair: Pair) -> list[Samples]:
    """The pair as the worker streams it."""
    thin = pair[::SAMPLE_STRIDE]
    return [
        Samples(
            "run", start, block.mirror.time_s.astype("f4"),
            block.faulted.channels, block.mirror.channels,
            block.faulted.states.astype("f4"), block.mirror.states.astype("f4"),
        )
        for start in range(0, len(thin.mirror), 25)
        for block in [thin[start : start + 25]]
    ]  # fmt: skip


# -- viser -----------------------------------------------------------------------------------------


def viser_position(frame: Frame, node: str) -> list[float]:
    """Where the browser has put a node."""
    found: list[float] = frame.evaluate(
        f"window.__viserMutable.nodePoseData['{node}']?.position ?? []"
    )
    return found


@pytest.mark.parametrize("dark", [False, True], ids=["light", "dark"])
def test_viser_shows_both_paths_and_comes_back_after_a_break(
    site: Site, page: Page, pair: Pair, console_errors: list[str], dark: bool
) -> None:
    session = secrets.token_urlsafe(16)
    scene = site.scenes.open(session)
    scene.dark = dark
    frame = site.frame(page, f"/viser/{session}/", sandbox=False)
    triangles = "window.__viserTestpoints?.rendererInfo?.render?.triangles ?? 0"
    wait(lambda: scene.viewers == 1 and frame.evaluate(triangles) > 0, "the empty scene")
    page.wait_for_timeout(1500)
    empty = picture(page)
    assert like(empty, FAULTED) == 0
    assert (empty.mean() < 90) == dark

    scene.reset(PLAN.duration_s, FAULT.onset_s)
    for samples in streamed(pair):
        scene.extend(samples)
    wait(lambda: like(picture(page), FAULTED) > 400, "the faulted path")
    wait(lambda: like(picture(page), MIRROR) > 400 + like(empty, MIRROR), "the mirror's path")
    assert changed(empty, picture(page)) > 0.02
    assert "/onset/post" in frame.evaluate("Object.keys(window.__viserMutable.nodePoseData)")

    before = set(scene._server.get_clients())
    scene._server._websock_server.disconnect_all_clients()
    wait(
        lambda: set(scene._server.get_clients()) - before,
        "the page to reconnect by itself, unfocused in its iframe",
    )

    def together() -> bool | None:
        """Whether both aircraft are at one place; None while one of them is not there."""
        places = [viser_position(frame, f"/{name}/aircraft") for name in ("faulted", "mirror")]
        return np.allclose(*places, atol=1e-6) if all(places) else None

    wait(lambda: together() is False, "both aircraft at the end of their flights")
    scene.seek(20.0)
    wait(together, "the moment before the fault, when they were at one place")
    assert console_errors == []


# -- Rerun -----------------------------------------------------------------------------------------


def rerun_time_s(frame: Frame) -> float:
    """Where the viewer's time cursor is."""
    nanos = frame.evaluate(
        f"""import("/rerun/{VERSION}/viewer.js").then((module) => module.viewer.get_state())
        .then((state) => Number(state.recordings[0]?.current_time?.time ?? -1))"""
    )
    return float(nanos) / 1e9


@pytest.mark.parametrize("theme", ["light", "dark"])
def test_rerun_shows_both_paths_as_they_grow_and_again_from_the_store(
    site: Site, page: Page, pair: Pair, console_errors: list[str], theme: str
) -> None:
    run = site.store.create(PLAN, FAULT).id
    address = f"/rerun/viewer.html?url=/recordings/{run}.rrd&theme={theme}"
    recording = site.recordings.open(run)
    first, *rest = streamed(pair)
    recording.extend(first)
    frame = site.frame(page, address, sandbox=True)
    wait(lambda: "ready" in page.evaluate("window.told"), "the live recording")
    wait(lambda: rerun_time_s(frame) > 4.0, "the first samples")
    page.wait_for_timeout(1000)
    scene = np.s_[30:370, 0 : int(SIZE["width"] * 0.58)]
    empty = picture(page)[scene]
    assert (empty.mean() < 90) == (theme == "dark")

    for samples in rest:
        recording.extend(samples)
    site.store.save_recording(run, lambda path: write_recording(path, pair, PLAN, FAULT))
    recording.finish(None)
    wait(lambda: rerun_time_s(frame) > 119.0, "the end of the live recording")
    wait(lambda: like(picture(page)[scene], FAULTED) > 5 * like(empty, FAULTED), "its path")
    wait(lambda: like(picture(page)[scene], MIRROR) > 5 * like(empty, MIRROR), "the mirror's path")
    assert changed(empty, picture(page)[scene]) > 0.02

    frame = site.frame(page, address, sandbox=True)
    wait(lambda: "ready" in page.evaluate("window.told"), "the stored recording")
    wait(lambda: like(picture(page)[scene], FAULTED) > 5 * like(empty, FAULTED), "the stored path")
    at_end = picture(page)[scene]
    page.evaluate("window.frames[0].postMessage({type: 'seek', time_s: 20}, '*')")
    wait(lambda: rerun_time_s(frame) == 20.0, "the seek")
    wait(lambda: changed(at_end, picture(page)[scene]) > 0.002, "the aircraft to move")
    assert console_errors == []


def test_rerun_says_when_there_is_no_recording(
    site: Site, page: Page, console_errors: list[str]
) -> None:
    frame = site.frame(page, "/rerun/viewer.html?url=/recordings/none.rrd", sandbox=True)
    wait(lambda: "no recording" in (frame.text_content("#notice") or ""), "the notice")


@pytest.mark.parametrize("url", ["https://evil.example/x.rrd", "//evil.example/x.rrd", "/assets/x"])
def test_rerun_opens_nothing_from_elsewhere(site: Site, page: Page, url: str) -> None:
    asked: list[str] = []
    page.on("request", lambda request: asked.append(request.url))
    frame = site.frame(page, f"/rerun/viewer.html?url={url}", sandbox=True)
    wait(lambda: "no recording" in (frame.text_content("#notice") or ""), "the notice")
    assert all(address.startswith(site.url) for address in asked)
    assert f"{site.url}/assets/x" not in asked
