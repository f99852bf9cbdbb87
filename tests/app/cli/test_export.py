"""``mirrortwin export`` and ``import``: a run goes out of one store and into another."""

import json
from pathlib import Path

import pytest

from app.cli import main
from core.diagnosis.predict import load_diagnoser
from core.exchange.log_files import read_logs
from core.fmea.fault import Fault
from core.report.case.case import open_case
from core.report.grounded import grounded_template
from core.store.store import RunStore
from core.twin.flight import fly_pair
from core.twin.plan import Plan


@pytest.fixture(scope="module")
def stored(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, str]:
    """A store with one finished run, and the run's name."""
    root = tmp_path_factory.mktemp("store")
    store = RunStore(root)
    plan, fault = Plan(duration_s=60.0, seed=9), Fault("engine_failure", 0.8, 20.0)
    pair = fly_pair(plan, fault)
    run_id = store.create(plan, fault).id
    diagnosis = load_diagnoser().diagnose(pair)
    store.save_pair(run_id, pair)
    store.save_result(run_id, diagnosis, grounded_template(open_case(diagnosis)))
    store.close()
    return root, run_id


def test_out_of_one_store_and_into_another(
    stored: tuple[Path, str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    root, run_id = stored
    out, other = tmp_path / "run.zip", tmp_path / "other"
    assert main(["export", run_id, "--out", str(out), "--store", str(root), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["bytes"] == out.stat().st_size
    take = ["import", str(out), "--store", str(other), "--json"]
    assert main(take) == 0
    assert json.loads(capsys.readouterr().out)[0]["id"] == run_id
    assert RunStore(other).get(run_id) == RunStore(root).get(run_id)
    assert main(take) == 2
    assert "in this store already" in capsys.readouterr().err


def test_a_log_and_a_recording(stored: tuple[Path, str], tmp_path: Path) -> None:
    root, run_id = stored
    for form, start in (("csv", b"#airframe_info"), ("rrd", b"RRF2")):
        out = tmp_path / f"run.{form}"
        options = ["--format", form, "--out", str(out), "--store", str(root)]
        assert main(["export", run_id, *options]) == 0
        assert out.read_bytes().startswith(start)


@pytest.mark.parametrize("there", [False, True], ids=["new folder", "existing folder"])
def test_a_folder_takes_both_flights_as_logs(
    stored: tuple[Path, str], tmp_path: Path, capsys: pytest.CaptureFixture[str], there: bool
) -> None:
    root, run_id = stored
    out = tmp_path / ("my.logs" if there else "logs")
    if there:
        out.mkdir()
    command = ["export", run_id, "--format", "csv", "--out", str(out), "--store", str(root)]
    assert main(command) == 0
    names = [f"mirrortwin-{run_id}-{side}.csv" for side in ("faulted", "mirror")]
    assert sorted(path.name for path in out.iterdir()) == names
    said = capsys.readouterr().out
    assert all(str(out / name) in said for name in names)
    logs, refused = read_logs(out)
    assert not refused and all(log.reading.simulated and len(log) == 60 for log in logs)
    faulted, mirror = logs
    assert faulted.channel("E1 RPM")[-1] < mirror.channel("E1 RPM")[-1] - 100.0
    heads = {path.read_text().splitlines()[0] for path in out.iterdir()}
    assert len(heads) == 2
    assert main([*command, "--side", "mirror", "--json"]) == 0
    written = json.loads(capsys.readouterr().out)
    assert written["files"] == [str(out / names[1])]
    assert written["bytes"] == (out / names[1]).stat().st_size


def test_one_file_is_the_faulted_flight_unless_asked_otherwise(
    stored: tuple[Path, str], tmp_path: Path
) -> None:
    root, run_id = stored
    for options, side in (([], "faulted"), (["--side", "mirror"], "mirror")):
        out = tmp_path / f"{side}.csv"
        where = ["--out", str(out), "--store", str(root)]
        assert main(["export", run_id, "--format", "csv", *options, *where]) == 0
        assert f'system_id="{run_id}-{side}"' in out.read_text()


@pytest.mark.parametrize("form", ["zip", "rrd"])
def test_a_folder_takes_the_other_formats_too(
    stored: tuple[Path, str], tmp_path: Path, form: str
) -> None:
    root, run_id = stored
    out = tmp_path / "taken" / "along"
    assert main(["export", run_id, "--format", form, "--out", str(out), "--store", str(root)]) == 0
    assert [path.name for path in out.iterdir()] == [f"mirrortwin-{run_id}.{form}"]


def test_what_cannot_be_done_is_one_line(
    stored: tuple[Path, str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    root, run_id = stored
    where = ["--store", str(root)]
    nowhere = ["--out", str(tmp_path / "no" / "x.zip"), *where]
    in_the_way = tmp_path / "taken"
    in_the_way.write_bytes(b"")
    onto_a_file = ["--format", "csv", "--out", str(in_the_way), *where]
    wrong = tmp_path / "wrong.zip"
    wrong.write_bytes(b"PK")
    for command, status, said in (
        (["export", "nonsense", "--out", str(tmp_path / "x.zip"), *where], 1, "no run 'nonsense'"),
        (["export", run_id, *nowhere], 2, "out: there is no folder"),
        (["export", run_id, *onto_a_file], 2, "out: cannot write to"),
        (["import", str(wrong), *where], 2, "file: is not a zip file"),
        (["import", str(tmp_path / "none.zip"), *where], 2, "file: cannot be read"),
    ):
        assert main(command) == status
        told = capsys.readouterr().err
        assert said in told and told.count("\n") == 1
