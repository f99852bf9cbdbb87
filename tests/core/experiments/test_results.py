"""What an experiment leaves behind, also where no browser can print it."""

import json
import re
from pathlib import Path
from typing import Any

import plotly.graph_objects as go
import pytest

from core.errors import MirrorTwinError, StoreError
from core.experiments.paper.fig6 import departure
from core.experiments.paper.representative import fly_modes
from core.experiments.results import Result, write_result
from core.experiments.signs.signatures import signatures
from core.experiments.signs.signs import CLEAR, fly_shifts, judge
from core.paths import RESULTS
from core.twin.plan import Plan


def _result(name: str = "wave") -> Result:
    figure = go.Figure(go.Scatter(y=[0.0, 1.0, 0.0]), {"width": 300, "height": 200})
    return Result(name, {"seeds": [7], "power": "fixed"}, {"held": 1, "of": 2}, figure, ("a line",))


@pytest.mark.browser
def test_json_page_and_picture(tmp_path: Path):
    content = write_result(_result(), tmp_path / "results")
    folder = tmp_path / "results"
    assert json.loads((folder / "wave.json").read_text()) == content
    assert content["held"] == 1
    assert content["settings"] == {"seeds": [7], "power": "fixed"}
    assert {"commit", "twin", "jsbsim"} <= set(content["provenance"])
    picture = (folder / "wave.png").read_bytes()
    assert picture.startswith(b"\x89PNG")
    assert int.from_bytes(picture[16:20]) == 600  # twice the figure's width
    assert not list(folder.glob("*.tmp"))


@pytest.fixture
def no_browser(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("BROWSER_PATH", "/nonexistent/chromium")


def test_without_a_browser_json_and_page_are_written_all_the_same(tmp_path: Path, no_browser):
    with pytest.raises(MirrorTwinError, match=r"no picture wave\.png .* BROWSER_PATH"):
        write_result(_result(), tmp_path)
    assert (tmp_path / "wave.json").is_file()
    assert (tmp_path / "wave.html").is_file()
    assert not (tmp_path / "wave.png").exists()


def test_pages_need_no_network_and_share_one_script(tmp_path: Path, no_browser):
    for name in ("wave", "tide"):
        with pytest.raises(MirrorTwinError):
            write_result(_result(name), tmp_path)
    assert [path.name for path in tmp_path.glob("*.js")] == ["plotly.min.js"]
    for name in ("wave", "tide"):
        page = (tmp_path / f"{name}.html").read_text(encoding="utf-8")
        assert re.findall(r'<script[^>]* src="([^"]+)"', page) == ["plotly.min.js"]


def test_a_folder_that_cannot_be_written_to_is_named(tmp_path: Path):
    (tmp_path / "file").touch()
    with pytest.raises(StoreError, match="file"):
        write_result(_result(), tmp_path / "file" / "results")


def _shipped(name: str) -> dict[str, Any]:
    content: dict[str, Any] = json.loads((RESULTS / f"{name}.json").read_text(encoding="utf-8"))
    return content


def test_shipped_realism_is_of_all_flights_and_holds_figures_of_the_logs_but_no_log():
    content = _shipped("realism")
    assert content["settings"]["quick"] is False
    assert content["settings"]["flights"] == 200
    assert content["held"]["means"] == {"held": 23, "of": 23}
    assert content["held"]["noise"]["held"] >= 21
    assert content["held"]["correlations"]["held"] >= 11
    for log in content["logs"]:
        assert set(log) == {"name", "rows", "cruise_s", "steady_s", "missing"}
    sizes = [(RESULTS / f"realism.{kind}").stat().st_size for kind in ("json", "html")]
    assert max(sizes) < 40_000  # three logs of an hour each would not fit


@pytest.mark.parametrize("name", ["fig6", "fig7", "signs", "speed"])
def test_shipped_results_are_whole_and_of_the_full_length(name):
    content = _shipped(name)
    assert content["settings"]["quick"] is False
    assert (content["settings"]["conditions"], content["settings"]["power"]) == ("lab", "fixed")
    assert content["provenance"]["commit"] != "unknown"
    assert (RESULTS / f"{name}.png").read_bytes().startswith(b"\x89PNG")
    assert "plotly.min.js" in (RESULTS / f"{name}.html").read_text(encoding="utf-8")


@pytest.mark.parametrize("mode", ["engine_failure", "intake_gasket_leak"])
def test_shipped_paths_are_what_the_twin_flies_today(mode):
    """Where this fails the twin has changed: run `mirrortwin experiment fig6` again."""
    shipped = _shipped("fig6")
    plan = Plan.from_dict(shipped["settings"]["plan"])
    flown = departure(fly_modes(plan, [mode], lambda share: None)[mode])
    assert flown == pytest.approx(shipped["faults"][mode], rel=0.01, abs=0.05)


@pytest.mark.slow
@pytest.mark.parametrize("mode", ["cylinder_crack", "oil_cooler_maintenance"])
def test_shipped_signs_are_what_the_twin_shows_today(mode):
    """Where this fails the twin has changed: run `mirrortwin experiment signs` again."""
    shipped = _shipped("signs")
    plans = [Plan.from_dict(plan) for plan in shipped["settings"]["plans"]]
    shifts = fly_shifts(plans, [mode], [CLEAR])
    for row in judge(signatures(), shifts):
        (found,) = (
            each
            for each in shipped["rows"]
            if (each["fault"], each["channel"]) == (mode, row.channel)
        )
        assert found["delta"] == pytest.approx(row.delta, rel=0.01, abs=0.1 * row.resolution)
        assert found["held"] == row.held
