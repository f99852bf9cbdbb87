"""The report on the page: verdicts, citing sentences, writers, questions, files to take away."""

import re
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from hostile import ChatServer, Handler, Reply, chat_server, refuses_the_key, title_of
from playwright.sync_api import Page, expect

from core.report.sections import SECTION_TITLES

pytestmark = [pytest.mark.browser, pytest.mark.usefixtures("without_3d")]

TIMEOUT_MS = 120_000

HELD_S = 300.0
"""How long the model holds its first sentence at most, until a test lets it go on."""


class Endpoint:
    """A language model whose behaviour a test sets, and which notes its first token's time."""

    def __init__(self) -> None:
        self.reply: Reply = refuses_the_key
        self.first_token_s = 0.0
        self.go_on = threading.Event()

    def __call__(self, handler: Handler) -> None:
        self.reply(handler)

    def says_what_is_false(self, handler: Handler) -> None:
        """Two sentences a section, the first one slowly."""
        handler.begin()
        first = title_of(handler.server.requests[-1]) == SECTION_TITLES[0]
        handler.say("CHT 4 rose ")
        if first:
            self.go_on.wait(HELD_S)
        handler.say("by 300 °F. The <b>turbocharger</b> failed <img src=/x onerror=alert(1)>.")
        handler.wfile.write(b"data: [DONE]\n\n")


@pytest.fixture(scope="module")
def endpoint() -> Iterator[tuple[Endpoint, ChatServer]]:
    model = Endpoint()
    with chat_server(model) as server:
        yield model, server


@pytest.fixture(scope="module")
def done(
    endpoint: tuple[Endpoint, ChatServer], start_one_server: Callable[[], Any], browser: Any
) -> Iterator[tuple[Any, str]]:
    """A server with an endpoint, and the address of a finished run on it."""
    with pytest.MonkeyPatch.context() as environment:
        environment.setenv("MIRRORTWIN_LLM_URL", endpoint[1].url)
        environment.setenv("MIRRORTWIN_LLM_MODEL", "test-model")
        environment.setenv("MIRRORTWIN_LLM_KEY", "sk-secret-of-the-test")
        server = start_one_server()
    page = browser.new_page()
    page.goto(server.url)
    page.locator("#run").click(timeout=TIMEOUT_MS)
    page.locator("#fly[data-status=done]").wait_for(timeout=TIMEOUT_MS)
    yield server, page.url
    page.close()


@pytest.fixture
def report(page: Page, done: tuple[Any, str]) -> Page:
    expect.set_options(timeout=TIMEOUT_MS)
    page.set_viewport_size({"width": 1440, "height": 900})
    page.goto(done[1])
    page.locator("#report h2").nth(4).wait_for(timeout=TIMEOUT_MS)
    # The whole flight is drawn last; out of view, when the browser has time.
    undrawn = page.locator(".tile-chart:is([data-samples='0'], :not([data-samples]))")
    expect(undrawn).to_have_count(0, timeout=TIMEOUT_MS)
    return page


def choose(page: Page, writer: str) -> None:
    page.locator("#report-writer").click()
    page.get_by_role("option", name=writer).click()
    page.locator("#report-write").click()


def test_each_sentence_is_marked_and_measured(report: Page, console_errors: list[str]) -> None:
    claims = report.locator("#report .claim")
    verdicts = claims.evaluate_all("all => all.map(one => one.dataset.verdict)")
    assert len(verdicts) > 30
    assert set(verdicts) <= {"supported", "plain"}
    expect(report.locator("#outcome")).to_contain_text("✓ right")
    expect(report.locator("#report")).to_have_text(re.compile("^Conclusion"))
    measures = report.locator("#report .measures")
    expect(measures).to_be_hidden()
    report.locator("#report summary").click()
    expect(measures).to_be_visible()
    values = measures.locator("dd").all_inner_texts()
    assert list(map(float, values)) == [1.0, 1.0, 1.0, 0.0]
    assert console_errors == []


def seconds(clock: str) -> int:
    minutes, rest = clock.split(":")
    return 60 * int(minutes) + int(rest)


SEEN_AT = """
() => [...document.querySelectorAll(".tile-chart")].filter((tile) => {
  const { top, bottom } = tile.getBoundingClientRect();
  return bottom > 0 && top < innerHeight;
}).map((tile) => parseFloat(tile.dataset.cursorS))
"""
"""Where the cursor is in each tile in view, in seconds of flight."""


def test_a_sentence_moves_the_cursor_and_lights_its_channels(report: Page) -> None:
    row = report.locator("#report tr.claim", has_text="CHT 4").first
    row.click()
    lit = report.locator(".tile.cited")
    expect(lit).to_have_count(1)
    assert "CHT 4" in lit.inner_text()
    start = row.locator("td").nth(1).inner_text().split("-")[0]
    expect(report.locator("#scrub-time")).to_have_text(start)
    for tile in ("#tile-22", "#tile-13"):  # what is scrolled to afterwards shows it as well
        report.locator(tile).scroll_into_view_if_needed()
        report.wait_for_function(
            f"times => ({SEEN_AT})().every(time => Math.abs(time - {seconds(start)}) <= 2)"
        )
        assert len(report.evaluate(SEEN_AT)) >= 2
    row.click()
    expect(lit).to_have_count(0)


def test_the_keyboard_goes_from_sentence_to_sentence(report: Page) -> None:
    citing = report.locator('#report .claim[role="button"]')
    assert report.locator('#report .claim[tabindex="0"]').count() == 1
    citing.first.focus()
    report.keyboard.press("ArrowDown")
    report.keyboard.press("Enter")
    expect(citing.nth(1)).to_have_attribute("aria-pressed", "true")
    assert report.locator(".tile.cited").count() >= 1
    report.keyboard.press("Escape")
    expect(report.locator(".tile.cited")).to_have_count(0)


def test_a_model_writes_anew_is_checked_and_stays(
    report: Page,
    endpoint: tuple[Endpoint, ChatServer],
    console_errors: list[str],
) -> None:
    model, server = endpoint
    model.reply = model.says_what_is_false
    model.go_on.clear()
    choose(report, "test-model")
    expect(report.locator("#report .draft")).to_have_text("CHT 4 rose")
    expect(report.locator("#report-status")).to_contain_text("test-model writes")
    model.go_on.set()

    expect(report.locator("#report")).to_contain_text("Written by test-model", timeout=TIMEOUT_MS)
    struck = report.locator("#report .claim:has(del)")
    assert struck.count() >= 2
    assert struck.first.get_attribute("data-verdict") == "contradicted"
    assert {"contradicted", "unsupported"} <= set(
        struck.evaluate_all("all => all.map(one => one.dataset.verdict)")
    )
    expect(report.locator("#report .added")).to_have_count(len(SECTION_TITLES))
    assert "<b>turbocharger</b>" in report.locator("#report").inner_text()
    assert report.locator("#report :is(b, img)").count() == 0
    measures = report.locator("#report .measures").text_content()
    assert "raw 1.000.00" in measures
    assert server.headers[-1]["Authorization"] == "Bearer sk-secret-of-the-test"
    assert "sk-secret-of-the-test" not in report.content()

    text = report.locator("#report").inner_text()
    report.reload()
    expect(report.locator("#report")).to_have_text(text, use_inner_text=True, timeout=TIMEOUT_MS)
    assert console_errors == []


def test_a_writer_that_hangs_can_be_stopped_and_the_plots_stay(
    report: Page, endpoint: tuple[Endpoint, ChatServer]
) -> None:
    model, _ = endpoint
    model.reply = model.says_what_is_false
    model.go_on.clear()
    text = report.locator("#report").inner_text()
    choose(report, "test-model")
    expect(report.locator("#report .draft")).to_have_text("CHT 4 rose")
    report.locator("#tile-0 .u-over").first.hover()
    expect(report.locator("#readout-0")).to_contain_text("Δ")
    report.locator("#report-stop").click()
    expect(report.locator("#report-status")).to_contain_text("was stopped")
    expect(report.locator("#report")).to_have_text(text, use_inner_text=True)
    model.go_on.set()


def test_a_writer_that_is_refused_leaves_a_whole_report(
    report: Page, endpoint: tuple[Endpoint, ChatServer]
) -> None:
    endpoint[0].reply = refuses_the_key
    time.sleep(0.1)
    choose(report, "test-model")
    expect(report.locator("#report")).to_contain_text("rejected the API key", timeout=TIMEOUT_MS)
    assert report.locator("#report h2").all_inner_texts() == list(SECTION_TITLES)
    choose(report, "Template")
    expect(report.locator("#report")).not_to_contain_text("Written by")


def test_a_question_is_answered_from_what_is_known(report: Page) -> None:
    box = report.get_by_label("Ask about this report")
    box.fill("why not the oil cooler?")
    box.press("Enter")
    answer = report.locator("#answers")
    expect(answer).to_contain_text("why not the oil cooler?")
    expect(answer.locator(".claim").first).to_contain_text("Oil cooler maintenance")
    box.fill("")
    box.press("Enter")
    expect(report.locator("#report-panel")).to_contain_text("question: is empty")


def test_the_report_can_be_taken_away(report: Page, done: tuple[Any, str]) -> None:
    run_id = done[1].rpartition("/")[2]
    for kind, start in (("HTML", b"<!doctype html>"), ("PDF", b"%PDF-"), ("Markdown", b"# ")):
        with report.expect_download() as begun:
            report.locator("#report a", has_text=kind).click()
        assert run_id in begun.value.suggested_filename
        content = Path(begun.value.path()).read_bytes()
        assert content.startswith(start)
        if kind != "PDF":
            assert run_id in content.decode()
            assert "Simulated flight" in content.decode()
