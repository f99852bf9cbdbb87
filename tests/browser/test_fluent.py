"""The page stays free for its user while a flight streams: no task of it takes long."""

from collections import Counter
from collections.abc import Callable
from typing import Any

import pytest
from playwright.sync_api import Browser, Page, expect

from core.report.sections import SECTION_TITLES

pytestmark = [pytest.mark.browser, pytest.mark.slow]

TIMEOUT_MS = 120_000

LONGEST_MS = 300.0
"""No task of the page may be longer, in the time that it has the processor to itself.

Three times the 100 ms that are the aim: on a busy machine the same work takes more of that time.
"""

TRIES = 3
"""The middle of so many runs counts if the first meets a busy moment of the machine."""

CATEGORIES = ["toplevel", "devtools.timeline"]


def main_thread_ms(events: list[dict[str, Any]]) -> list[float]:
    """Processor time of each task of the thread that lays the page out, in milliseconds.

    Not the time by the clock: what other programs do meanwhile is no fault of the page.
    """
    layouts = Counter(
        (event["pid"], event["tid"]) for event in events if event["name"] == "UpdateLayoutTree"
    )
    thread = layouts.most_common(1)[0][0]
    return [
        event["tdur"] / 1000.0
        for event in events
        if event["name"].endswith("RunTask")
        and (event["pid"], event["tid"]) == thread
        and "tdur" in event
    ]


def one_run(page: Page, browser: Browser, url: str) -> float:
    """The longest task from the click on Run until the report stands, in milliseconds."""
    page.goto(url)
    expect(page.locator("#tile-0 canvas").first).to_be_visible(timeout=TIMEOUT_MS)
    page.wait_for_timeout(1000)  # the page's own start is not what is measured
    events: list[dict[str, Any]] = []
    ended: list[Any] = []
    tracing = browser.new_browser_cdp_session()
    tracing.on("Tracing.dataCollected", lambda part: events.extend(part["value"]))
    tracing.on("Tracing.tracingComplete", lambda end: ended.append(end))
    config = {"includedCategories": CATEGORIES, "excludedCategories": ["*"]}
    tracing.send("Tracing.start", {"traceConfig": config})
    page.locator("#run").click()
    expect(page.locator("#fly[data-status=done]")).to_be_visible(timeout=TIMEOUT_MS)
    expect(page.locator("#report h2")).to_have_count(len(SECTION_TITLES), timeout=TIMEOUT_MS)
    page.wait_for_timeout(1000)  # tiles out of view are drawn last
    tracing.send("Tracing.end")
    while not ended:
        page.wait_for_timeout(50)
    tracing.detach()
    return max(main_thread_ms(events))


def test_no_task_holds_the_page_up_while_a_flight_streams_and_its_report_comes(
    page: Page, browser: Browser, server: Any, record_property: Callable[[str, object], None]
) -> None:
    # The 3D view is not of our making, and here its shaders are compiled by the processor.
    page.route("**/viser/**", lambda route: route.abort())
    page.set_viewport_size({"width": 1440, "height": 900})
    longest_ms = one_run(page, browser, server.url)
    if longest_ms > LONGEST_MS:
        again = [one_run(page, browser, server.url) for _ in range(TRIES - 1)]
        longest_ms = sorted([longest_ms, *again])[TRIES // 2]
    record_property("longest_task_ms", round(longest_ms))
    print(f"longest task {longest_ms:.0f} ms")
    assert longest_ms < LONGEST_MS
