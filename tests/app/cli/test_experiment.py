"""experiment and bench: what they write and print, on as little data as they take."""

import json

import pytest

from core.experiments.registry import RUNNABLE


@pytest.mark.slow
def test_an_experiment_leaves_figures_a_picture_and_a_page(mirrortwin, tmp_path):
    done = mirrortwin("experiment", "fig7", "--quick", "--out", "OUT", "--json")
    assert done.returncode == 0, done.stderr
    written = json.loads((tmp_path / "out" / "fig7.json").read_text())
    assert json.loads(done.stdout) == written
    assert written["experiment"] == "fig7"
    assert written["settings"]["quick"] is True
    assert (tmp_path / "out" / "fig7.png").read_bytes().startswith(b"\x89PNG")
    assert "plotly" in (tmp_path / "out" / "fig7.html").read_text().lower()


def test_every_experiment_is_named_in_help(mirrortwin):
    told = mirrortwin("experiment", "--help").stdout
    assert all(f"  {name} " in told for name in RUNNABLE)


@pytest.mark.slow
def test_bench_prints_ratios_to_the_bare_loop(mirrortwin):
    done = mirrortwin("bench", "--rounds", "1", "--quick", "--json")
    assert done.returncode == 0, done.stderr
    speed = json.loads(done.stdout)
    assert speed["steps"] == 15_000
    # One round on a machine that may do anything beside it: whether the figures are figures of
    # what they say, not how good they are (`mirrortwin experiment speed` keeps that).
    assert speed["trajectory_ratio"] == speed["trajectory_s"] / speed["bare_s"] > 0.5
    assert speed["pair_ratio"] == speed["pair_s"] / speed["bare_s"] > 0.5
    assert speed["long_flight_cost_ratio"] > 0.0 < speed["two_worker_speedup"]
