"""dataset and train, end to end and small: the commands by which the shipped models were made."""

import json
from pathlib import Path

import pytest

from app.cli.output import progress

pytestmark = pytest.mark.slow


def test_a_small_data_set_trains_a_model(mirrortwin, tmp_path: Path):
    request = ("dataset", "--runs-per-class", "4", "--seed", "2000000", "--out", "OUT", "--json")
    flown = mirrortwin(*request)
    assert flown.returncode == 0, flown.stderr
    told = json.loads(flown.stdout)
    assert sum(told["runs"].values()) == 80
    assert told["spec"]["first_seed"] == 2_000_000
    assert "100 %" in flown.stderr

    models = tmp_path / "models"
    trained = mirrortwin("train", "--data", "OUT", "--out", str(models), "--epochs", "1")
    assert trained.returncode == 0, trained.stderr
    assert "epoch 1/1" in trained.stderr
    assert "macro-F1" in trained.stdout
    (card,) = models.glob("*.json")
    assert card.stem in trained.stdout
    assert card.with_suffix(".safetensors").is_file()

    again = mirrortwin(*request)
    assert json.loads(again.stdout) == told


def test_progress_in_a_log_is_a_line_a_tenth(capsys, monkeypatch):
    monkeypatch.setattr("app.cli.output._SILENT_S", 0.0)
    with progress("working") as show:
        for step in range(41):
            show(step / 40)
    assert capsys.readouterr().err.splitlines() == [
        f"working: {percent} %" for percent in range(10, 101, 10)
    ]
