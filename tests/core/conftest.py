"""Flights and models for the tests of `core`: made up where no simulator is needed, else real."""

import os
import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
import torch
from jobs_support import CRACK, SHORT_PLAN

from core.channels import CHANNEL_INDEX, CHANNEL_NAMES, CHANNELS, N_CHANNELS
from core.clock import DT_S
from core.dataset.archive import Archive, StoredRun
from core.diagnosis.features import FEATURE_MODES, N_FEATURES, Normalisation
from core.diagnosis.networks import Cnn1d
from core.diagnosis.predict import Diagnoser
from core.fmea.catalogue import class_ids
from core.jobs.engine import Engine
from core.model_card import Card, load_model
from core.paths import MODELS
from core.store.store import RunStore
from core.twin.flight import fly_pair
from core.twin.trajectory import STATE_NAMES, Pair, Trajectory


@pytest.fixture(scope="session")
def short_pair() -> Pair:
    """What `SHORT_PLAN` with `CRACK` looks like, flown in this process."""
    return fly_pair(SHORT_PLAN, CRACK)


@pytest.fixture
def store(tmp_path: Path) -> Iterator[RunStore]:
    """An empty store."""
    opened = RunStore(tmp_path / "store")
    yield opened
    opened.close()


@pytest.fixture(scope="session")
def engine(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Engine]:
    """An engine with two worker processes, for all tests that leave it alive."""
    started = Engine(RunStore(tmp_path_factory.mktemp("engine")), n_workers=2)
    started.wait_warm(timeout=240)
    yield started
    started.close()


@pytest.fixture
def disk(tmp_path: Path) -> Iterator[Callable[[str], Path]]:
    """``disk("size=1m")``: a small disk of its own, mounted with those options; again: remounted.

    Skips where the system does not let this user mount.
    """
    where = tmp_path / "disk"
    where.mkdir()

    def mount(options: str) -> Path:
        if os.path.ismount(where):
            options = f"remount,{options}"
        command = ["mount", "-t", "tmpfs", "-o", options, "tmpfs", str(where)]
        try:
            subprocess.run(command, check=True, capture_output=True)
        except (OSError, subprocess.CalledProcessError):
            pytest.skip("this user may not mount a disk")
        return where

    yield mount
    if os.path.ismount(where):
        subprocess.run(["umount", "--lazy", str(where)], check=True)


Shift = tuple[str, float, float, float]
"""Channel, size in its unit, first and last second of a step away from the mirror."""

FlightMaker = Callable[..., Pair]


def noisy_pair(duration_s: float, *shifts: Shift, seed: int = 0) -> Pair:
    """A flight of sensor noise and its mirror, equal but for the ``shifts``."""
    n = round(duration_s / DT_S)
    rng = np.random.default_rng(seed)
    noise = [channel.noise_sd for channel in CHANNELS]
    mirror = (100.0 + rng.normal(size=(n, N_CHANNELS)) * noise).astype(np.float32)
    faulted = mirror.copy()
    time_s = np.arange(n) * DT_S
    for name, size, start_s, stop_s in shifts:
        faulted[(time_s >= start_s) & (time_s < stop_s), CHANNEL_INDEX[name]] += np.float32(size)
    states = rng.normal(size=(n, len(STATE_NAMES)))
    return Pair(Trajectory(time_s, states, faulted), Trajectory(time_s, states, mirror))


@pytest.fixture(scope="session")
def make_pair() -> FlightMaker:
    """``make_pair(duration_s, (channel, size, start_s, stop_s), ...)``: see `noisy_pair`."""
    return noisy_pair


@pytest.fixture(scope="session")
def shipped_card() -> Card:
    """The card of the classifier that is shipped."""
    card, _ = load_model(MODELS, "cnn-paired-lab")
    return card


@pytest.fixture(scope="session")
def untrained() -> Diagnoser:
    """The paper's network with random weights that favour no class: it mechanically works."""
    torch.manual_seed(3)
    flights = [noisy_pair(40.0, ("E1 CHT1", 5.0, 10.0, 40.0), seed=seed) for seed in range(2)]
    return Diagnoser(
        name="untrained",
        classes=class_ids(),
        conditions="lab",
        mode=FEATURE_MODES["paired"],
        normalisation=Normalisation.fitted(
            ((pair.residual, pair.faulted.channels) for pair in flights), FEATURE_MODES["paired"]
        ),
        network=Cnn1d(N_FEATURES, len(class_ids())).eval(),
    )


SPLITS = ("train", "train", "validation", "test")


@pytest.fixture(scope="session")
def dataset(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Made up: four runs a class, and each class but the nominal lifts a channel of its own."""
    folder = tmp_path_factory.mktemp("dataset")
    archive = Archive.open(folder, {"conditions": "lab"})
    ids = []
    for number, mode in enumerate(class_ids()):
        for repeat, split in enumerate(SPLITS):
            seed = 4 * number + repeat
            shift = (
                [(CHANNEL_NAMES[number % N_CHANNELS], 50.0, 31.0, 65.0)]
                if mode != "nominal"
                else []
            )
            pair = noisy_pair(65.0, *shift, seed=seed)
            run = StoredRun(
                id=f"{mode}-{repeat}", mode=mode, split=split, start_row=0,
                departure_row=1550 if shift else None,
                plan={"seed": seed}, fault={"mode": mode, "onset_s": 31.0},
            )  # fmt: skip
            archive.add(run, np.stack([pair.faulted.channels, pair.mirror.channels]))
            ids.append(run.id)
    archive.complete(ids)
    return folder
