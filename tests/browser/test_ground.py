"""A flight that the ground has ended, on the page: as long as it was flown, and said."""

from collections.abc import Iterator
from typing import Any

import pytest
from page_modules import in_module
from playwright.sync_api import Page, expect

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
FELL = Plan(altitude_ft=2000.0, duration_s=1800.0, seed=3)

ENDS = """
() => ["probabilities", "residual-strip"].map((id) => {
  const plot = document.querySelector(`#${id} .js-plotly-plot`);
  if (!plot || !plot._fullLayout) return null;
  const { xaxis } = plot._fullLayout;
  return Math.round(xaxis.r2l(xaxis.range[1]) / 1000);
})
"""
"""Until when the Plotly charts go, in seconds of flight."""


@pytest.fixture
def fallen_run(server: Any) -> Iterator[str]:
    """A flight of half an hour in the server's store, over after three minutes."""
    store, fault = RunStore(server.store), Fault("engine_failure", 1.0, 10.0)
    pair = fly_pair(FELL, fault)
    diagnosis = load_diagnoser().diagnose(pair)
    run_id = store.create(FELL, fault).id
    store.save_pair(run_id, pair)
    store.save_result(run_id, diagnosis, grounded_template(open_case(diagnosis)))
    yield run_id
    delete(store, [run_id])
    store.close()


def test_charts_end_where_the_flight_did_and_the_page_says_why(
    page: Page, server: Any, fallen_run: str, console_errors: list[str]
) -> None:
    page.set_default_timeout(TIMEOUT_MS)
    page.goto(f"{server.url}/run/{fallen_run}")
    said = page.locator("#flight-events li").first
    expect(said).to_contain_text("The flight ends at 3:14: the aircraft met the ground",
                                 timeout=TIMEOUT_MS)  # fmt: skip
    expect(page.locator("#stage")).to_have_text("3:14 of 30:00")
    page.wait_for_function(f"({ENDS})().every((end_s) => end_s === 194)")
    assert round(page.evaluate(in_module("fly/flight.js", "module.flight.duration_s"))) == 194
    assert not console_errors
