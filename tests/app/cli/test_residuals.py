"""diagnose by either residual: with the mirror that was flown, or with none."""

import json

import pytest

pytestmark = pytest.mark.slow

FAULT = ("--fault", "oil_cooler_maintenance", "--severity", "0.9", "--onset", "40", "--seed", "11")


def test_the_surrogate_needs_no_mirror_and_not_what_was_injected(mirrortwin, tmp_path):
    flown = mirrortwin("simulate", *FAULT, "--duration", "160", "--out", "OUT")
    assert flown.returncode == 0, flown.stderr
    (tmp_path / "out" / "mirror.parquet").unlink()
    run = json.loads((tmp_path / "out" / "run.json").read_text())
    del run["fault"]
    (tmp_path / "out" / "run.json").write_text(json.dumps(run))
    told = mirrortwin("diagnose", "OUT", "--residual", "surrogate", "--json")
    assert told.returncode == 0, told.stderr
    diagnosis = json.loads(told.stdout)
    assert (diagnosis["model"], diagnosis["conditions"]) == ("cnn-surrogate-lab", "lab")
    assert diagnosis["top"] == "oil_cooler_maintenance"
    assert diagnosis["onset_s"] == pytest.approx(40.0, abs=15.0)
    assert "E1 OilT" in {item["channel"] for item in diagnosis["evidence"]}
    (tmp_path / "out" / "run.json").unlink()
    blind = mirrortwin("diagnose", "OUT", "--residual", "surrogate")
    assert blind.returncode == 2
    assert "plan: the surrogate has to know what was commanded" in blind.stderr


def test_a_flight_is_diagnosed_by_the_model_of_its_conditions_unless_paraphrases(mirrortwin):
    short = ("--duration", "60", "--conditions", "field", "--out", "OUT")
    assert mirrortwin("simulate", *FAULT, *short).returncode == 0
    told = mirrortwin("diagnose", "OUT")
    assert told.returncode == 0, told.stderr
    assert "cnn-paired-field, trained for field conditions" in told.stdout
    assert "its scores do not apply here" not in told.stderr
    told = mirrortwin("diagnose", "OUT", "--conditions", "lab")
    assert told.returncode == 0, told.stderr
    assert "cnn-paired-lab, trained for lab conditions" in told.stdout
    assert "flown in field conditions" in told.stderr
    assert "its scores do not apply here" in told.stderr
