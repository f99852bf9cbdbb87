"""simulate writes the same flight for the same request; diagnose reads the flight alone."""

import json
import subprocess
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest

from core.channels import CHANNEL_NAMES
from core.fmea.catalogue import catalogue

FAULT = ("--fault", "baffle_crack", "--severity", "0.8", "--onset", "60")
PARQUET = ("faulted.parquet", "mirror.parquet")


@pytest.fixture(scope="module")
def flights(command: str, tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    """The same request, carried out by two processes."""
    folders = [tmp_path_factory.mktemp("simulate") / "flight" for _ in range(2)]
    for folder in folders:
        subprocess.run(
            [command, "simulate", *FAULT, "--seed", "7", "--out", folder],
            check=True,
            capture_output=True,
        )
    return folders


def test_writes_what_scripts_expect(flights):
    written = sorted(path.name for path in flights[0].iterdir())
    assert written == ["faulted.parquet", "mirror.parquet", "run.json", "run.rrd"]
    run = json.loads((flights[0] / "run.json").read_text())
    assert run["fault"] == {
        "mode": "baffle_crack",
        "severity": 0.8,
        "onset_s": 60.0,
        "cylinder": None,
    }
    assert run["plan"]["seed"] == 7
    assert (flights[0] / "run.rrd").read_bytes()[:3] == b"RRF"


def test_two_processes_write_the_same_bytes(flights):
    first, second = flights
    for name in PARQUET:
        assert pq.read_table(first / name).equals(pq.read_table(second / name))
        assert (first / name).read_bytes() == (second / name).read_bytes()


def test_the_flights_part_at_the_onset_and_not_before(flights):
    faulted, mirror = (pq.read_table(flights[0] / name) for name in PARQUET)
    assert [name for name in faulted.column_names if name in CHANNEL_NAMES] == list(CHANNEL_NAMES)
    time_s = faulted["time_s"].to_numpy()
    assert len(time_s) == 15_000
    differs = np.zeros(len(time_s), dtype=bool)
    for name in CHANNEL_NAMES:
        differs |= faulted[name].to_numpy() != mirror[name].to_numpy()
    assert not differs[time_s < 60.0].any()
    assert differs[time_s > 120.0].all()


def test_diagnose_reads_the_flight_and_not_what_was_injected(flights, mirrortwin):
    folder = flights[1]
    told = mirrortwin("diagnose", str(folder), "--json")
    (folder / "run.json").write_text(json.dumps({"fault": {"mode": "engine_failure"}}))
    assert mirrortwin("diagnose", str(folder), "--json").stdout == told.stdout
    for name in ("run.json", "run.rrd"):
        (folder / name).unlink()
    assert mirrortwin("diagnose", str(folder), "--json").stdout == told.stdout
    diagnosis = json.loads(told.stdout)
    assert list(diagnosis["probabilities"]) == list(catalogue())
    assert sum(diagnosis["probabilities"].values()) == pytest.approx(1.0, abs=1e-5)
    assert diagnosis["top"] == max(diagnosis["probabilities"], key=diagnosis["probabilities"].get)
    assert diagnosis["top"] == "baffle_crack"
    assert {item["channel"] for item in diagnosis["evidence"]} <= set(CHANNEL_NAMES)
    assert "E1 CHT1" in {item["channel"] for item in diagnosis["evidence"]}


def test_diagnose_speaks_to_people_too(flights, mirrortwin):
    done = mirrortwin("diagnose", str(flights[0]))
    assert done.returncode == 0
    assert "baffle_crack" in done.stdout
    assert "E1 CHT1" in done.stdout


def test_halves_of_two_flights_are_refused(flights, mirrortwin, tmp_path):
    assert (
        mirrortwin("simulate", "--duration", "30", "--onset", "10", "--out", "OUT").returncode == 0
    )
    (tmp_path / "out" / "mirror.parquet").write_bytes((flights[0] / "mirror.parquet").read_bytes())
    done = mirrortwin("diagnose", "OUT")
    assert done.returncode == 2
    assert "not of one flight" in done.stderr


def test_options_win_over_the_plan_file(mirrortwin, tmp_path):
    (tmp_path / "plan.toml").write_text(
        "altitude_ft = 5200\nspeed_kt = 95\nduration_s = 60\n[weather]\nwind_kt = 9\n"
    )
    changed = ("--speed", "105", "--isa", "12", "--conditions", "field")
    done = mirrortwin("simulate", "--plan", "plan.toml", *changed, "--out", "OUT", "--json")
    assert done.returncode == 0, done.stderr
    told = json.loads(done.stdout)
    assert (told["plan"]["altitude_ft"], told["plan"]["speed_kt"]) == (5200.0, 105.0)
    assert told["plan"]["weather"]["wind_kt"] == 9.0
    assert told["plan"]["weather"]["isa_deviation_degc"] == 12.0
    assert told["plan"]["conditions"] == "field"
    assert told["samples"] == 3000
    assert sorted(Path(path).name for path in told["files"]) == sorted(
        path.name for path in (tmp_path / "out").iterdir()
    )


def test_a_nominal_flight_is_its_own_mirror(mirrortwin, tmp_path):
    assert mirrortwin("simulate", "--duration", "60", "--out", "OUT").returncode == 0
    faulted, mirror = ((tmp_path / "out" / name).read_bytes() for name in PARQUET)
    assert faulted == mirror


def test_faults_are_told_as_scripts_expect(mirrortwin):
    told = json.loads(mirrortwin("faults", "--json").stdout)
    assert [mode["id"] for mode in told] == list(catalogue())
    assert {mode["subsystem"] for mode in told} == {mode.subsystem for mode in catalogue().values()}
    assert all(mode["id"] in mirrortwin("faults").stdout for mode in told[:3])


def test_what_is_done_on_the_way_is_flown_and_written(command: str, tmp_path: Path) -> None:
    actions, out = tmp_path / "actions.toml", tmp_path / "flight"
    actions.write_text(
        '[[actions]]\nkind = "fault"\ntime_s = 20\nmode = "engine_failure"\n'
        '[[actions]]\nkind = "repair"\ntime_s = 5\n'
    )
    asked = [command, "simulate", "--duration", "40", "--out", out, "--actions", actions]
    subprocess.run(asked, check=True, capture_output=True)
    told = json.loads((out / "run.json").read_text())["actions"]
    assert [(action["kind"], action["time_s"]) for action in told] == [("repair", 5), ("fault", 20)]
    faulted, mirror = (pq.read_table(out / name) for name in PARQUET)
    differs = faulted["E1 RPM"].to_numpy() != mirror["E1 RPM"].to_numpy()
    assert np.flatnonzero(differs)[0] == pytest.approx(1000, abs=60)
    actions.write_text('[[actions]]\nkind = "fault"\ntime_s = 50\nmode = "engine_failure"\n')
    refused = subprocess.run(asked, capture_output=True, text=True)
    assert refused.returncode != 0
    assert "time_s: must lie in 0 to 40 s" in refused.stderr
    assert "Traceback" not in refused.stderr


def test_a_flight_that_meets_the_ground_ends_there(mirrortwin, tmp_path):
    actions = tmp_path / "actions.toml"
    actions.write_text(
        '[[actions]]\nkind = "fault"\ntime_s = 10\nmode = "engine_failure"\nseverity = 1.0\n'
        '[[actions]]\nkind = "repair"\ntime_s = 500\n'
    )
    folder = tmp_path / "flight"
    done = mirrortwin(
        "simulate", "--altitude", "2000", "--duration", "600", "--actions", str(actions),
        "--out", str(folder), "--json",
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    ground_s = json.loads(done.stdout)["ground_s"]
    assert 150.0 < ground_s < 300.0
    assert f"ends at {ground_s:.1f} s: the aircraft met the ground" in done.stderr
    assert "1 of the actions" in done.stderr
    assert [each["kind"] for each in json.loads((folder / "run.json").read_text())["actions"]] == [
        "fault"
    ]
    time_s = pq.read_table(folder / "faulted.parquet")["time_s"].to_numpy()
    assert time_s[-1] == ground_s
