"""The page's modules in a real browser: Dash's renderer waits for them, and finds all it calls."""

import time
from typing import Any

import pytest
from playwright.sync_api import Page, Route, expect

pytestmark = [pytest.mark.browser, pytest.mark.usefixtures("without_3d")]

WAIT_S = 120.0


def test_the_page_waits_for_its_scripts_however_late_they_come(
    page: Page, server: Any, console_errors: list[str]
) -> None:
    page.set_default_timeout(WAIT_S * 1000)
    held: list[Route] = []
    page.route("**/kit/time.js", lambda route: held.append(route))
    page.goto(server.url, wait_until="commit")
    deadline = time.monotonic() + WAIT_S
    while not (held and page.evaluate("window.DashRenderer !== undefined")):
        assert time.monotonic() < deadline, "Dash's own scripts are there"
        page.wait_for_timeout(50)
    assert page.locator("#fly").count() == 0
    for route in held:
        route.continue_()
    expect(page.locator("#fly")).to_be_visible(timeout=WAIT_S * 1000)
    expect(page.locator("#nav-fly")).to_have_attribute("aria-current", "page")
    missing = page.evaluate(
        """async () => {
            const called = await (await fetch("/_dash-dependencies")).json();
            return called
                .map((callback) => callback.clientside_function)
                .filter((given) => given && given.namespace !== "_dashprivate_clientside_funcs")
                .filter((given) =>
                    typeof dash_clientside[given.namespace]?.[given.function_name] !== "function")
                .map((given) => `${given.namespace}.${given.function_name}`);
        }"""
    )
    assert missing == []
    assert console_errors == []
