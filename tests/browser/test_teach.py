"""Mystery flights in a real browser: flown, marked, answered, and hidden until then."""

import json
import re
from typing import Any
from urllib.error import HTTPError
from urllib.request import urlopen

import pytest
from playwright.sync_api import BrowserContext, Page, Response, expect

from core.fmea.catalogue import catalogue
from core.store.store import RunStore

pytestmark = [pytest.mark.browser, pytest.mark.usefixtures("without_3d")]

TIMEOUT_MS = 120_000


@pytest.fixture(autouse=True)
def patient(context: BrowserContext) -> None:
    """Give a busy machine time."""
    context.set_default_timeout(TIMEOUT_MS)
    expect.set_options(timeout=TIMEOUT_MS)


LISTEN = """
const Plain = SharedWorker;
window.SharedWorker = function (...how) {
  const worker = new Plain(...how);
  worker.port.addEventListener("message", (event) => heard(JSON.stringify(event.data)));
  return worker;
};
"""
"""Dash keeps its socket in a worker that all tabs share, where Playwright does not look."""


@pytest.fixture
def told(context: BrowserContext) -> list[str]:
    """All that the server will have told any tab: answers and socket messages."""
    heard: list[str] = []
    context.expose_function("heard", lambda message: heard.append(message))
    context.add_init_script(LISTEN)

    def keep(answer: Response) -> None:
        if not re.search(r"/assets/|_dash-component|/viser/", answer.url):
            heard.append(answer.text())

    context.on("response", keep)
    return heard


def status(url: str) -> int:
    try:
        with urlopen(url) as answer:
            return int(answer.status)
    except HTTPError as error:
        return error.code


def test_the_fault_is_nowhere_until_it_is_answered(
    page: Page,
    context: BrowserContext,
    server: Any,
    told: list[str],
    console_errors: list[str],
) -> None:
    store = RunStore(server.store)
    before = len(store.records())
    # What the runs of other tests name, the lists may name.
    other = context.new_page()
    listed = named_in_lists(other, server.url, told)
    told.clear()
    page.goto(f"{server.url}/teach")
    page.get_by_role("textbox", name="Code").fill("hidden-1")
    page.get_by_role("button", name="Fly it").click()
    chart = page.get_by_role("slider", name="EGT 1 against time")
    expect(chart.locator("canvas")).to_be_visible()
    attempt_id = page.evaluate("location.pathname").removeprefix("/teach/")
    truth = json.loads((server.store / "teach" / attempt_id / "truth.json").read_text())

    # Marked by keyboard; kept over a reload.
    chart.focus()
    for _ in range(4):
        page.keyboard.press("PageUp")
    page.keyboard.press("Enter")
    page.keyboard.press("ArrowDown")
    page.keyboard.press("Enter")
    expect(page.locator(".marks li")).to_contain_text("EGT 1 fallsfrom 2:00")
    page.reload()
    expect(page.locator(".marks li")).to_have_count(1)
    for path in ("/teach", f"/teach/{attempt_id}"):
        other.goto(server.url + path)
        expect(other.get_by_role("heading", level=1)).to_be_visible()
    expect(other.locator(".marks li")).to_have_count(1)
    expect(other.locator("#mystery-0 canvas").first).to_be_visible()
    assert_silent(told, truth)
    assert len(store.records()) == before
    so_far = len(told)
    lists = context.new_page()
    assert named_in_lists(lists, server.url, told) == listed
    assert not any(attempt_id in message for message in told[so_far:])
    del told[so_far:]
    for path in (
        f"/run/{attempt_id}",
        f"/present/{attempt_id}",
        f"/recordings/{attempt_id}.rrd",
        f"/compare/{attempt_id}",
        f"/runs/files?id={attempt_id}",
        *(f"/runs/{attempt_id}/report.{kind}" for kind in ("html", "md", "pdf")),
    ):
        assert status(server.url + path) == 404

    # The mirror is drawn when asked for, and not before.
    assert {len(rows) for rows in drawn(told)} == {2}
    already = len(told)
    page.get_by_role("button", name=re.compile("Show the mirror")).click()
    expect(page.get_by_text("healthy mirror")).to_be_visible()
    assert {len(rows) for rows in drawn(told[already:])} == {3}
    assert_silent(told, truth)

    name = catalogue()[truth["fault"]["mode"]].name
    answer = page.get_by_role("textbox", name="Failure mode")
    answer.click()
    answer.fill(name)
    page.get_by_role("option", name=name, exact=True).click()
    page.get_by_role("button", name="Submit").click()
    expect(page.locator("#mystery-truth")).to_have_text(name)
    points = int(page.locator("#mystery-score").inner_text())
    assert 55 <= points + 15 <= 100
    assert len(store.records()) == before + 1
    # The other tab can neither answer nor mark any more.
    other.get_by_role("button", name=re.compile("Show the mirror")).click()
    expect(other.get_by_role("alert").first).to_contain_text("is over")
    other.goto(f"{server.url}/teach")
    expect(other.get_by_role("cell", name=f"{points} of 100")).to_be_visible()
    # The same code again leads to the flight that was answered.
    other.get_by_role("textbox", name="Code").fill("hidden-1")
    other.get_by_role("button", name="Fly it").click()
    expect(other.locator("#mystery-truth")).to_have_text(name)
    page.get_by_role("link", name="Open the full run").click()
    expect(page.locator("#fly[data-status=done]")).to_be_attached()
    page.wait_for_function(
        "async url => (await fetch(url)).ok",
        arg=f"/recordings/{store.records()[0].id}.rrd",
    )
    store.close()
    assert console_errors == []


def named_in_lists(page: Page, url: str, told: list[str]) -> set[str]:
    """The modes that the lists of runs name."""
    so_far = len(told)
    for path in ("/runs", "/compare"):
        page.goto(url + path)
        expect(page.get_by_role("heading", level=1)).to_be_visible()
    heard = "\n".join(told[so_far:])
    return {mode.id for mode in catalogue().values() if mode.id in heard or mode.name in heard}


def assert_silent(messages: list[str], truth: dict[str, Any]) -> None:
    """Nothing of what the server told tells this mode from any other, or names seed or onset."""
    told = "\n".join(messages)
    listed = {
        (told.count(f'"{mode.id}"'), told.count(f'"{mode.name}"')) for mode in catalogue().values()
    }
    assert len(listed) == 1, "a mode is named more or less often than the others"
    assert min(listed)[0] > 0, "the list of answers must have been heard"
    assert str(truth["plan"]["seed"]) not in told
    assert '"onset_s":null' in told.replace(" ", "")
    assert not re.search(r'"onset_s":\s*[0-9]', told)
    assert "over_time" not in told and '"evidence"' not in told


def drawn(told: list[str]) -> list[list[str]]:
    """The columns of every chart that was sent."""
    return [
        rows
        for text in told
        for channels in re.findall(r'"channels":\s*(\[\[".*?"\]\])', text)
        for rows in json.loads(channels)
    ]


def test_teach_fits_a_telephone(page: Page, server: Any) -> None:
    page.set_viewport_size({"width": 390, "height": 844})
    page.goto(f"{server.url}/teach")
    page.get_by_role("button", name="Fly it").click()
    expect(page.locator("#mystery-0 canvas").first).to_be_visible()
    assert page.evaluate("document.documentElement.scrollWidth") <= 390
    page.once("dialog", lambda dialog: dialog.accept())
    page.get_by_role("button", name="Give up").click()
    expect(page.locator("#mystery-score")).to_have_text("0")
    assert page.evaluate("document.documentElement.scrollWidth") <= 390
