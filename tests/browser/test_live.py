"""A live flight in a real browser: paced, paused, broken, steered and mended on its way."""

import re
from collections.abc import Callable
from typing import Any

import pytest
from playwright.sync_api import BrowserContext, Page, expect

from core.files import read_json
from core.store.records import RunRecord
from core.store.store import RunStore
from core.twin.actions import Repair, SetFault, SetTarget
from core.twin.flight import fly_pair

pytestmark = [pytest.mark.browser, pytest.mark.usefixtures("without_3d")]

TIMEOUT_MS = 120_000


def opened(page: Page, url: str) -> Page:
    page.set_default_timeout(TIMEOUT_MS)
    page.goto(url)
    expect(page.locator("#tile-0 canvas").first).to_be_visible(timeout=TIMEOUT_MS)
    return page


def wait_for(page: Page, status: str) -> None:
    page.locator(f"#fly[data-status={status}]").wait_for(timeout=TIMEOUT_MS)


def flown(page: Page) -> str:
    return page.locator("#stage").inner_text()


def finished(store: RunStore, page: Page) -> RunRecord:
    """The run at the page's address once it is stored: the page may still show the one before."""
    run_id = page.url.rsplit("/", 1)[1]
    for _ in range(300):
        if store.get(run_id).finished:
            break
        page.wait_for_timeout(100)
    return store.get(run_id)


def test_a_live_flight_is_broken_steered_and_mended_on_its_way(
    page: Page,
    server: Any,
    console_errors: list[str],
    new_context: Callable[..., BrowserContext],
) -> None:
    page.set_viewport_size({"width": 1440, "height": 900})
    opened(page, server.url)
    patient = expect(page.locator("#live-actions li"))
    expect(page.locator("#live-bar")).to_be_hidden()
    # No fault at first, and live at x10.
    page.locator("#field-fault").fill("Nominal")
    page.get_by_role("option").first.click()
    page.locator("#pace").get_by_text("×10", exact=True).click()
    page.locator("#run").click()
    expect(page.locator("#live-bar")).to_be_visible(timeout=TIMEOUT_MS)
    expect(page.locator("#live-pace-10")).to_have_attribute("aria-pressed", "true")
    expect(page.locator("#stage")).to_have_text(
        re.compile(r"Flying \d+:\d\d of"), timeout=TIMEOUT_MS
    )

    # By keyboard: what is out of range is said at its field, and nothing is done.
    severity = page.locator("#live-severity")
    severity.fill("7")
    page.locator("#live-do-inject").focus()
    page.keyboard.press("Enter")
    expect(page.locator(".live-bar .mantine-InputWrapper-error")).to_contain_text("0 to 1")
    severity.fill("0.8")
    severity.blur()
    page.locator("#live-do-inject").focus()
    page.keyboard.press("Enter")
    patient.to_have_count(1, timeout=TIMEOUT_MS)
    expect(page.locator(".live-bar .mantine-InputWrapper-error")).to_have_count(0)
    expect(page.locator("#run-title")).to_contain_text("severity 0.80")

    page.locator("#live-pause").click()
    expect(page.locator("#live-pause")).to_have_text("Resume", timeout=TIMEOUT_MS)
    expect(page.locator("#stage")).to_have_text(re.compile("Paused at"))
    page.locator("#live-altitude_ft").fill("5200")
    page.locator("#live-altitude_ft").blur()
    page.locator("#live-do-target").click()
    patient.to_have_count(2, timeout=TIMEOUT_MS)
    expect(page.locator("#live-actions li").first).to_contain_text("5,200 ft")

    stood = flown(page)
    # The page comes back to the same pause, with everything that was done.
    page.reload()
    expect(page.locator("#live-pause")).to_have_text("Resume", timeout=TIMEOUT_MS)
    patient.to_have_count(2)
    expect(page.locator("#stage")).to_have_text(stood, timeout=TIMEOUT_MS)
    page.locator("#live-pause").click()
    expect(page.locator("#live-pause")).to_have_text("Pause", timeout=TIMEOUT_MS)
    page.locator("#live-do-repair").click()
    patient.to_have_count(3, timeout=TIMEOUT_MS)
    page.locator("#live-pace-inf").click()
    wait_for(page, "done")
    expect(page.locator("#live-bar")).to_be_hidden()
    lines = page.locator("#live-actions").inner_text()
    for words in ("Engine repaired", "5,200 ft", "Engine running rough injected, severity 0.80"):
        assert words in lines
    assert re.match(r"\d+:\d\d", lines)
    expect(page.locator("#report h2")).not_to_have_count(0)

    run_id = page.url.rsplit("/", 1)[1]
    store = RunStore(server.store)
    record = store.get(run_id)
    assert [type(action) for action in record.actions] == [SetFault, SetTarget, Repair]
    assert read_json(store.recording_path(run_id).with_name("run.json"))["record"]["actions"]
    pair = fly_pair(record.plan, record.fault, record.actions)
    assert store.load_pair(run_id).residual.tobytes() == pair.residual.tobytes()

    other = opened(new_context().new_page(), page.url)
    wait_for(other, "done")
    expect(other.locator("#live-actions li")).to_have_count(3)
    other.locator("#again").click()
    other.wait_for_url(lambda url: not url.endswith(run_id))
    wait_for(other, "done")
    again = finished(store, other)
    assert again.actions == record.actions
    assert store.load_pair(again.id).residual.tobytes() == pair.residual.tobytes()
    store.close()
    assert console_errors == []
