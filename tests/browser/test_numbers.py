"""Numbers as they are pasted and typed into the form: understood, or refused with a sentence."""

import json
from typing import Any

import pytest
from playwright.sync_api import Page, expect

pytestmark = [pytest.mark.browser, pytest.mark.usefixtures("without_3d")]

TIMEOUT_MS = 120_000

UNDERSTOOD = {
    "field-seed": {
        "1,234": "1234",
        "1 234": "1234",
        "1\u00a0234": "1234",
        "1\u202f234": "1234",
        "1'234": "1234",
        "１２３": "123",
        " 42\n": "42",
        "7.0": "7",
    },
    "field-altitude_ft": {
        "5,000": "5000 ft",
        "5\u202f000 ft": "5000 ft",
        "5,000.5": "5000.5 ft",
        "5.000,5": "5000.5 ft",
        "5000,5": "5000.5 ft",
        "\u22125": "-5 ft",
    },
    "field-onset_s": {"0,8": "0.8 s", "1.25": "1.25 s", "12,345,678": "12345678 s"},
}
REFUSED = {
    "field-seed": ("0,8", "1.5", "1e3", "0x10", "12 34", "1_000", "12abc", "٣"),
    "field-altitude_ft": ("1500 m", "1e3", "1,2,3", "10²", "½"),
}


class Form:
    """The number fields of the form on Fly."""

    def __init__(self, page: Page) -> None:
        self.page = page

    def value(self, field: str) -> Any:
        """What Dash holds, and would send."""
        return self.page.evaluate("id => dash_component_api.getLayout(id).props.value", field)

    def error(self, field: str) -> str:
        return str(
            self.page.evaluate("id => dash_component_api.getLayout(id).props.error ?? ''", field)
        )

    def select(self, field: str) -> None:
        self.page.locator(f"#{field}").focus()
        self.page.keyboard.press("Control+a")

    def paste(self, field: str, text: str) -> None:
        self.page.evaluate("text => navigator.clipboard.writeText(text)", text)
        self.select(field)
        self.page.keyboard.press("Control+v")

    def type(self, field: str, text: str) -> None:
        self.select(field)
        self.page.keyboard.type(text)

    def put_caret(self, field: str, place: int) -> None:
        """Put the caret there; the field moves it by itself a moment after each keystroke."""
        self.page.locator(f"#{field}").focus()
        self.page.evaluate("() => new Promise((done) => setTimeout(done, 100))")
        self.page.locator(f"#{field}").evaluate(
            "(input, place) => input.setSelectionRange(place, place)", place
        )
        self.page.wait_for_function(
            "([id, place]) => document.getElementById(id).selectionStart === place",
            arg=[field, place],
            timeout=TIMEOUT_MS,
        )

    def expect_held(self, field: str, number: float | str) -> None:
        """Wait until Dash holds that number: it comes when the field has lost the focus."""
        self.page.locator(f"#{field}").blur()
        self.page.wait_for_function(
            "([id, wanted]) => JSON.stringify(dash_component_api.getLayout(id).props.value)"
            " === wanted",
            arg=[field, json.dumps(number)],
            timeout=TIMEOUT_MS,
        )


@pytest.fixture
def form(page: Page, server: Any) -> Form:
    page.context.grant_permissions(["clipboard-read", "clipboard-write"])
    page.goto(server.url, timeout=TIMEOUT_MS)
    expect(page.locator("#tile-0 canvas").first).to_be_visible(timeout=TIMEOUT_MS)
    return Form(page)


def test_a_pasted_number_is_the_one_that_was_meant_or_is_refused(
    form: Form, console_errors: list[str]
) -> None:
    for field, texts in UNDERSTOOD.items():
        for text, shown in texts.items():
            form.paste(field, "1" if text != "1" else "2")
            form.paste(field, text)
            expect(form.page.locator(f"#{field}")).to_have_value(shown)
            form.expect_held(field, json.loads(shown.split(" ")[0]))
            assert form.error(field) == ""
    for field, refused in REFUSED.items():
        for text in refused:
            form.paste(field, "2345")
            form.expect_held(field, 2345)
            form.paste(field, text)
            message = form.page.locator(f"#{field}-error")
            expect(message).to_contain_text(f'"{text}" was not taken: write a')
            form.expect_held(field, 2345)
        # What is right takes the sentence away.
        form.paste(field, "3456")
        expect(form.page.locator(f"#{field}-error")).to_have_count(0)
        form.expect_held(field, 3456)
    assert console_errors == []


def test_a_typed_number_is_the_one_that_was_meant_or_is_refused(form: Form) -> None:
    for text, number in {"0,8": 0.8, "1.5": 1.5, "-2": -2, "1,234": 1234, "90": 90}.items():
        form.type("field-onset_s", text)
        form.expect_held("field-onset_s", number)
        assert form.error("field-onset_s") == ""
    for text in ("1e3", "0,8", "1.5", "1 2"):
        form.type("field-seed", text)
        expect(form.page.locator("#field-seed-error")).to_contain_text("a whole number")
        form.type("field-seed", "42")
        expect(form.page.locator("#field-seed-error")).to_have_count(0)
        form.expect_held("field-seed", 42)
    # Into a number that stands there already.
    form.type("field-altitude_ft", "5000")
    form.expect_held("field-altitude_ft", 5000)
    form.put_caret("field-altitude_ft", 1)
    form.page.keyboard.insert_text("７,")
    form.expect_held("field-altitude_ft", 57000)
    form.page.locator("#field-altitude_ft").press("x")
    form.expect_held("field-altitude_ft", 57000)
    expect(form.page.locator("#field-altitude_ft-error")).to_contain_text("in ft")


def test_what_an_input_method_writes_is_read_too(form: Form) -> None:
    session = form.page.context.new_cdp_session(form.page)
    form.select("field-seed")
    for text in ("１", "１２", "１２３"):
        at = len(text)
        session.send(
            "Input.imeSetComposition", {"text": text, "selectionStart": at, "selectionEnd": at}
        )
    session.send("Input.insertText", {"text": "１２３"})
    form.expect_held("field-seed", 123)
