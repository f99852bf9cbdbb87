"""The data set: who is in it, what is kept, and what a kill costs."""

import json
import os
import signal
import subprocess
import sys
import time
from collections import Counter
from dataclasses import replace

import numpy as np
import pytest

from core.channels import N_CHANNELS
from core.clock import DT_S
from core.dataset.archive import Archive, StoredRun, read_manifest, read_run, run_path
from core.dataset.generate import DatasetSpec, fly_run, generate, planned_runs
from core.errors import InputError, WorkerError
from core.fmea.catalogue import catalogue, class_ids
from core.residual.window import EFFECTIVE_STEPS, STRIDE_STEPS, WINDOW_STEPS
from core.twin.flight import fly, fly_pair
from core.workers.scheduler import RemoteScheduler

SPEC = DatasetSpec.load()
SMALL = replace(SPEC, runs_per_class=4, duration_s=70.0, onset_s=(30.0, 35.0))


def test_every_class_has_its_runs_in_every_part():
    parts = Counter((run.fault.mode, run.split) for run in planned_runs(SPEC))
    assert {mode for mode, _ in parts} == set(class_ids())
    for mode in class_ids():
        counts = [parts[mode, part] for part in ("train", "validation", "test")]
        assert counts == [48, 8, 24]  # 70/30 by run; the validation part is cut from the 70


def test_no_two_runs_share_a_seed():
    runs = planned_runs(SPEC)
    assert (
        len({run.plan.seed for run in runs}) == len(runs) == len(class_ids()) * SPEC.runs_per_class
    )
    assert len({run.id for run in runs}) == len(runs)


def test_any_beginning_of_the_data_set_is_balanced():
    assert [run.fault.mode for run in planned_runs(SPEC)[: len(class_ids())]] == list(class_ids())


def test_flights_follow_the_specification():
    runs = planned_runs(SPEC)
    assert all(4500 <= run.plan.altitude_ft <= 5500 for run in runs)
    assert all(90 <= run.plan.speed_kt <= 110 for run in runs)
    for name in ("severity", "onset_s"):
        low, high = getattr(SPEC, name)
        values = np.array([getattr(run.fault, name) for run in runs])
        assert low <= values.min() < low + 0.02 * (high - low)
        assert high >= values.max() > high - 0.02 * (high - low)
        assert values.mean() == pytest.approx((low + high) / 2, rel=0.05)


def test_cylinders_follow_the_records():
    runs = planned_runs(replace(SPEC, runs_per_class=1000))
    for mode in catalogue().values():
        drawn = Counter(run.fault.cylinder for run in runs if run.fault.mode == mode.id)
        if mode.whole_engine:
            assert set(drawn) == {None}
        else:
            shares = [drawn[cylinder] / 1000 for cylinder in (1, 2, 3, 4)]
            assert shares == pytest.approx(mode.prior, abs=0.06)


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("runs_per_class", 0),
        ("first_seed", 2**31 - 5),
        ("duration_s", 5.0),
        ("severity", (0.5, 1.5)),
        ("onset_s", (100.0, 50.0)),
        ("test_share", 1.0),
        ("conditions", "dream"),
    ],
)
def test_bad_specifications_name_their_field(field, value):
    with pytest.raises(InputError, match=field):
        replace(SPEC, **{field: value})


def test_an_unknown_field_in_the_file_is_named(tmp_path):
    path = tmp_path / "spec.toml"
    path.write_text("runs_a_class = 4\n")
    with pytest.raises(InputError, match="runs_a_class"):
        DatasetSpec.load(path)


@pytest.mark.parametrize("mode", ["nominal", "baffle_rivet", "engine_failure"])
def test_the_kept_stretch_is_a_part_of_the_flight(mode):
    run = next(run for run in planned_runs(SPEC) if run.fault.mode == mode)
    flown, whole = fly_run(run), fly_pair(run.plan, run.fault)
    rows = slice(flown.start_row, flown.start_row + flown.channels.shape[1])
    np.testing.assert_array_equal(flown.channels[0], whole.faulted.channels[rows])
    np.testing.assert_array_equal(flown.channels[1], whole.mirror.channels[rows])
    onset_row = round(run.fault.onset_s * 50)
    assert rows.start % STRIDE_STEPS == rows.stop % STRIDE_STEPS == 0
    assert rows.start <= onset_row - WINDOW_STEPS < rows.start + STRIDE_STEPS
    if mode == "nominal":
        assert flown.departure_row is None
        assert not whole.residual.any()
    else:
        assert flown.departure_row >= onset_row
        assert not whole.residual[: flown.departure_row].any()
        assert whole.residual[flown.departure_row].any()
        assert rows.stop >= flown.departure_row + EFFECTIVE_STEPS


def _stored_run(run_id):
    return StoredRun(run_id, "nominal", "train", 0, None, {"seed": 1}, {"onset_s": 30.0})


@pytest.fixture(scope="module")
def small(tmp_path_factory):
    """A whole small data set and how its progress was reported."""
    folder = tmp_path_factory.mktemp("small")
    reported = []
    manifest = generate(SMALL, folder, progress=lambda done, total: reported.append((done, total)))
    return folder, manifest, reported


@pytest.mark.parametrize(("mode", "soonest_s", "latest_s"), [
    ("nominal", None, None), ("engine_failure", 0.0, 1.0), ("baffle_rivet", 15.0, 60.0),
])  # fmt: skip
def test_in_field_a_fault_shows_where_the_same_aircraft_would_have_flown_on(
    mode, soonest_s, latest_s
):
    """The field's mirror differs from the first sample on; a rivet takes its time to let go."""
    spec = DatasetSpec(runs_per_class=4, duration_s=240.0, severity=(0.6, 0.6), conditions="field")
    run = next(run for run in planned_runs(spec) if run.fault.mode == mode)
    run = replace(run, fault=replace(run.fault, onset_s=60.0))
    flown = fly_run(run)
    if soonest_s is None:
        assert flown.departure_row is None
        return
    after_s = flown.departure_row * DT_S - 60.0
    assert soonest_s <= after_s <= latest_s
    own = fly(run.plan).channels[flown.start_row : flown.departure_row]
    np.testing.assert_array_equal(flown.channels[0, : len(own)], own)
    shown = flown.departure_row - flown.start_row
    assert flown.channels.shape[1] >= shown + EFFECTIVE_STEPS


@pytest.mark.slow
def test_progress_counts_every_run(small):
    _, manifest, reported = small
    assert reported == [(done, 80) for done in range(81)]
    assert [run.id for run in manifest.runs] == [run.id for run in planned_runs(SMALL)]


@pytest.mark.slow
def test_the_manifest_says_what_was_flown_by_what(small):
    folder, manifest, _ = small
    assert read_manifest(folder) == manifest
    assert manifest.spec == SMALL.to_dict()
    assert set(manifest.provenance) >= {"mirrortwin", "commit", "twin", "jsbsim"}
    run = manifest.runs[17]
    pair = read_run(folder, run)
    assert pair.faulted.channels.shape[1] == N_CHANNELS
    assert pair.faulted.time_s[0] == pytest.approx(run.start_row / 50)
    assert not pair.residual[: run.shown_row].any()


@pytest.mark.slow
def test_a_damaged_run_is_flown_again_and_no_other(small):
    folder, manifest, _ = small
    victim = run_path(folder, manifest.runs[3].id)
    content = victim.read_bytes()
    victim.write_bytes(content[:-4])
    reported = []
    again = generate(SMALL, folder, progress=lambda done, total: reported.append(done))
    assert reported == [79, 80]
    assert victim.read_bytes() == content
    assert again.runs == manifest.runs


@pytest.mark.slow
def test_a_killed_generation_loses_and_doubles_nothing(small, tmp_path):
    _, manifest, _ = small
    script = (
        "from pathlib import Path; import sys\n"
        "from core.dataset.generate import DatasetSpec, generate\n"
        "if __name__ == '__main__':\n"
        f"    generate(DatasetSpec(**{SMALL.to_dict()!r}), Path(sys.argv[1]))\n"
    )
    (tmp_path / "run.py").write_text(script)
    victim = subprocess.Popen(
        [sys.executable, str(tmp_path / "run.py"), str(tmp_path / "out")],
        env=os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)},
        start_new_session=True,
    )
    deadline = time.monotonic() + 120
    runs = tmp_path / "out" / "runs"
    while len(list(runs.glob("*.npy"))) < 10 and time.monotonic() < deadline:
        time.sleep(0.05)
    os.killpg(victim.pid, signal.SIGKILL)
    victim.wait()
    reported = []
    again = generate(SMALL, tmp_path / "out", progress=lambda done, total: reported.append(done))
    assert reported[0] >= 9
    assert again.runs == manifest.runs


def test_a_folder_of_another_data_set_is_left_alone(tmp_path):
    Archive.open(tmp_path, SMALL.to_dict())
    before = (tmp_path / "journal.jsonl").read_bytes()
    with pytest.raises(InputError, match="holds a data set of another specification"):
        generate(replace(SMALL, first_seed=5), tmp_path)
    assert (tmp_path / "journal.jsonl").read_bytes() == before


def test_a_journal_cut_short_is_mended(tmp_path):
    archive = Archive.open(tmp_path, SMALL.to_dict())
    flown = np.zeros((2, 10, 23), dtype=np.float32)
    for number in range(2):
        run = _stored_run(f"run-{number}")
        archive.add(run, flown)
    journal = tmp_path / "journal.jsonl"
    journal.write_text(journal.read_text()[:-20])
    archive = Archive.open(tmp_path, SMALL.to_dict())
    assert archive.holds("run-0")
    assert not archive.holds("run-1")
    archive.add(_stored_run("run-1"), flown)
    lines = journal.read_text().splitlines()
    assert json.loads(lines[-1])["id"] == "run-1"
    assert Archive.open(tmp_path, SMALL.to_dict()).holds("run-1")


@pytest.mark.slow
def test_an_unreachable_scheduler_is_a_clear_error(tmp_path, free_port):
    with pytest.raises(WorkerError, match=f"scheduler answers at tcp://127.0.0.1:{free_port}"):
        generate(SMALL, tmp_path, scheduler=RemoteScheduler(f"tcp://127.0.0.1:{free_port}"))
