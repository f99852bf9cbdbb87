"""Controls that could have failed: chance, leaks between the parts, a kill in the middle."""

import json
import os
import signal
import subprocess
import sys
import time
from dataclasses import replace

import numpy as np
import pytest

from core.dataset.archive import read_run
from core.dataset.generate import DatasetSpec, planned_runs
from core.diagnosis.settings import TrainingSettings
from core.diagnosis.training import train

SETTINGS = TrainingSettings(epochs=3, patience=3, batch=8, seed=5)


@pytest.mark.slow
def test_shuffled_labels_give_chance(dataset, tmp_path):
    honest = train(dataset, tmp_path, SETTINGS, work_dir=tmp_path / "honest")
    shuffled = replace(SETTINGS, shuffled=True)
    control = train(dataset, tmp_path, shuffled, work_dir=tmp_path / "control")
    scores = [card["scores"]["test_windows"]["macro_f1"] for card in (honest, control)]
    assert scores[0] > 0.5
    assert scores[1] < 0.2  # chance is 0.05


def test_the_parts_share_no_run_no_seed_and_no_mirror():
    parts: dict[str, list] = {}
    for run in planned_runs(DatasetSpec.load()):
        parts.setdefault(run.split, []).append(run)
    assert set(parts) == {"train", "validation", "test"}
    for told in (lambda run: run.id, lambda run: run.plan.seed, lambda run: run.plan):
        seen = [{told(run) for run in runs} for runs in parts.values()]
        assert sum(map(len, seen)) == len(set().union(*seen))


def test_a_mirror_belongs_to_its_own_flight(dataset):
    from core.dataset.archive import read_manifest

    manifest = read_manifest(dataset)
    beginnings = {
        run.id: read_run(dataset, run).mirror.channels[:50].tobytes() for run in manifest.runs
    }
    assert len(set(beginnings.values())) == len(beginnings)
    for run in manifest.runs:
        pair = read_run(dataset, run)
        np.testing.assert_array_equal(
            pair.mirror.channels[: run.shown_row], pair.faulted.channels[: run.shown_row]
        )


TRAINING = """
import sys
from pathlib import Path
from core.diagnosis.settings import TrainingSettings
from core.diagnosis.training import train
data, out = map(Path, sys.argv[1:])
train(data, out, TrainingSettings(epochs=3, patience=3, batch=8, seed=5), work_dir=out)
"""


@pytest.mark.slow
def test_a_training_killed_by_force_ends_with_the_same_numbers(dataset, tmp_path):
    undisturbed = train(dataset, tmp_path / "whole", SETTINGS, work_dir=tmp_path / "whole")
    victim = subprocess.Popen(
        [sys.executable, "-c", TRAINING, str(dataset), str(tmp_path / "killed")],
        env=os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)},
    )
    deadline = time.monotonic() + 120
    while not (tmp_path / "killed" / "checkpoint.pt").exists() and time.monotonic() < deadline:
        time.sleep(0.02)
    victim.send_signal(signal.SIGKILL)
    victim.wait()
    assert not list((tmp_path / "killed").glob("*.json"))
    epochs = []
    again = train(
        dataset, tmp_path / "killed", SETTINGS, work_dir=tmp_path / "killed",
        progress=epochs.append,
    )  # fmt: skip
    assert 1 <= len(epochs) <= 2
    assert again["weights_sha256"] == undisturbed["weights_sha256"]
    assert json.dumps(again["scores"]) == json.dumps(undisturbed["scores"])
