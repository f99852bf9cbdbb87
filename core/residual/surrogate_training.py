"""Training of the surrogate on healthy flights of its own, resumable, and its card."""

import time
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import Tensor

from core.arrays import Array32
from core.channels import CHANNEL_NAMES, N_CHANNELS
from core.checkpoint import read_checkpoint, write_checkpoint
from core.checks import checked_number
from core.clock import LONGEST_S
from core.errors import InputError
from core.model_card import Card, save_model
from core.paths import MODELS
from core.provenance import provenance, twin_fingerprint
from core.residual.controls import CONTROL_NAMES, controls
from core.residual.gru import GruNetwork
from core.residual.surrogate import (
    BASELINE_ROWS,
    CHUNK,
    FLOOR_SHARE,
    SEGMENT,
    SMOOTH_STEPS,
    WARM,
    Surrogate,
)
from core.seeds import SURROGATE_SEED
from core.twin.flight import fly
from core.twin.plan import Conditions, Plan

COLD_STEPS = 25
"""Predictions of a network that has seen less than half a second do not count in the loss."""

USUAL_QUANTILE = 0.999


CHOSEN_HORIZON: dict[Conditions, int] = {"lab": 1, "field": 1}
"""So many steps ahead the shipped surrogates learnt to predict.

It is the horizon whose classifiers, over three seeds, did best on validation flights, of those that
were tried (``models/results/table4-lab.json`` and ``table4-field.json``).
"""


@dataclass(frozen=True, slots=True)
class SurrogateSettings:
    """How to train; the defaults are those of the shipped surrogates but for their horizon.

    ``flights`` are learnt from and ``held_out`` more give the residual's standard deviation and
    the errors on the card. The rate falls along a cosine to 0 over ``updates`` batches.
    """

    conditions: Conditions = "lab"
    horizon: int = 10
    seed: int = 0
    flights: int = 96
    held_out: int = 24
    duration_s: float = 300.0
    updates: int = 800
    batch: int = 48
    learning_rate: float = 2e-3
    threads: int = 1
    bfloat16: bool = True

    def __post_init__(self) -> None:
        """Raise `InputError` for a number out of range."""
        if self.conditions not in ("lab", "field"):
            raise InputError("conditions", f"must be lab or field, got {self.conditions!r}")
        checked_number("horizon", self.horizon, 1, 100)
        checked_number("flights", self.flights, 1, 10_000)
        checked_number("held_out", self.held_out, 1, 10_000)
        checked_number("duration_s", self.duration_s, 35.0, LONGEST_S)
        checked_number("updates", self.updates, 1, 1_000_000)
        checked_number("batch", self.batch, 1, 4096)
        checked_number("threads", self.threads, 1, 256)


@dataclass(frozen=True, slots=True)
class Step:
    """How training goes: updates done and of how many, and the mean loss since the last."""

    done: int
    of: int
    loss: float


REPORT_EVERY = 20

Flight = tuple[Array32, Array32]
"""Readings (n, 23) and commands (n, 4)."""


def nominal_flights(settings: SurrogateSettings, first: int, number: int) -> list[Flight]:
    """Healthy flights from the paper's cruise box, with seeds from ``SURROGATE_SEED + first``."""
    flights = []
    for seed in range(SURROGATE_SEED + first, SURROGATE_SEED + first + number):
        sampled = Plan.sampled(seed, duration_s=settings.duration_s)
        plan = replace(sampled, conditions=settings.conditions)
        channels = fly(plan).channels
        flights.append((channels, controls(plan, 0, len(channels))))
    return flights


def train_surrogate(
    models_dir: Path = MODELS,
    settings: SurrogateSettings | None = None,
    *,
    work_dir: Path,
    name: str | None = None,
    progress: Callable[[Step], None] | None = None,
) -> Card:
    """Fly healthy flights, train, measure on held-out ones, and save in ``models_dir``.

    A checkpoint is kept in ``work_dir``; called again with the same settings, training goes on
    where it stopped and ends with the same weights.
    """
    settings = settings or SurrogateSettings()
    torch.set_num_threads(settings.threads)
    torch.use_deterministic_algorithms(True)
    trainer = SurrogateTrainer(settings, nominal_flights(settings, 0, settings.flights))
    trainer.resume(work_dir / "surrogate.pt")
    trainer.run(progress or (lambda step: None))
    held_out = nominal_flights(settings, settings.flights, settings.held_out)
    name = name or f"gru-{settings.conditions}"
    surrogate, scores = calibrated(trainer.surrogate(name), held_out)
    card: Card = {
        "name": name,
        "title": "GRU surrogate",
        "conditions": settings.conditions,
        "horizon": settings.horizon,
        "inputs": [*CHANNEL_NAMES, *(f"commanded {control}" for control in CONTROL_NAMES)],
        "scores": {"held_out_flights": scores},
        "residual": {
            "divided_by": "its standard deviation on healthy flights, at least "
            f"{FLOOR_SHARE:.0%} of the sensor's range",
            "baseline_rows": [BASELINE_ROWS.start, BASELINE_ROWS.stop],
            "sliding_mean_steps": SMOOTH_STEPS,
            "chunk_steps": CHUNK,
            "warm_up_steps": WARM,
        },
        "training": trainer.summary(),
        "data": {
            "flights": "healthy only, from the cruise box of the data set",
            "seeds": {
                "train": [SURROGATE_SEED, SURROGATE_SEED + settings.flights - 1],
                "held_out": [
                    SURROGATE_SEED + settings.flights,
                    SURROGATE_SEED + settings.flights + settings.held_out - 1,
                ],
            },
        },
        "code": provenance(),
        "architecture": str(surrogate.network).splitlines(),
        "constants": {
            constant: [float(value) for value in getattr(surrogate, constant)]
            for constant in ("channel_mean", "channel_sd", "residual_sd", "usual")
        },
    }
    return save_model(models_dir, card, surrogate.network.state_dict())


def calibrated(surrogate: Surrogate, flights: list[Flight]) -> tuple[Surrogate, dict[str, Any]]:
    """The surrogate with its residual's scale from healthy flights, and its errors on them.

    Errors are of the prediction one step ahead: mean absolute and root mean square, each averaged
    over the channels, in channel units as in the paper's Table 4, and per channel.
    """
    errors = np.concatenate([surrogate.error(*flight)[CHUNK:] for flight in flights])
    absolute = np.abs(errors).mean(axis=0, dtype=np.float64)
    square = np.sqrt(np.square(errors, dtype=np.float64).mean(axis=0))
    scaled = replace(surrogate, residual_sd=errors.std(axis=0, dtype=np.float64).astype("f4"))
    finished = np.concatenate(
        [scaled.residual(*flight)[BASELINE_ROWS.stop :] for flight in flights]
    )
    usual = np.quantile(np.abs(finished), USUAL_QUANTILE, axis=0).astype(np.float32)
    scores = {
        "mae": float(absolute.mean()),
        "rmse": float(square.mean()),
        "mae_in_channel_sd": float((absolute / surrogate.channel_sd).mean()),
        "mae_by_channel": dict(zip(CHANNEL_NAMES, map(float, absolute), strict=True)),
        "rmse_by_channel": dict(zip(CHANNEL_NAMES, map(float, square), strict=True)),
    }
    return replace(scaled, usual=usual), scores


class SurrogateTrainer:
    """Fits one surrogate to healthy flights."""

    def __init__(self, settings: SurrogateSettings, flights: list[Flight]) -> None:
        """Start untrained; `resume` may put an earlier state in its place."""
        self.settings = settings
        readings = np.concatenate([channels for channels, _ in flights])
        torch.manual_seed(settings.seed)
        zeros = np.zeros(N_CHANNELS, dtype=np.float32)
        self._surrogate = Surrogate(
            name="",
            conditions=settings.conditions,
            fingerprint="",
            network=GruNetwork(settings.horizon),
            channel_mean=readings.mean(axis=0, dtype=np.float64).astype(np.float32),
            channel_sd=readings.std(axis=0, dtype=np.float64).astype(np.float32),
            residual_sd=zeros,
            usual=zeros,
        )
        self._inputs = [torch.from_numpy(self._surrogate.inputs(*flight)) for flight in flights]
        network = self._surrogate.network
        self._optimiser = torch.optim.Adam(network.parameters(), lr=settings.learning_rate)
        self._scheduler = torch.optim.lr_scheduler.CosineAnnealingLR(
            self._optimiser, settings.updates
        )
        self._losses: list[float] = []
        self._seconds = 0.0
        self._checkpoint: Path | None = None
        self._identity = {"settings": asdict(settings), "twin": twin_fingerprint()}

    def surrogate(self, name: str) -> Surrogate:
        """What has been learnt so far, its residual not calibrated yet."""
        self._surrogate.network.eval()
        return replace(self._surrogate, name=name)

    def run(self, progress: Callable[[Step], None]) -> None:
        """Train until the updates are used up."""
        of = self.settings.updates
        while len(self._losses) < of:
            started = time.perf_counter()
            stop = min(of, len(self._losses) + REPORT_EVERY)
            recent = [self._update(index) for index in range(len(self._losses), stop)]
            self._losses += recent
            self._seconds += time.perf_counter() - started
            self._save()
            progress(Step(len(self._losses), of, float(np.mean(recent))))

    def _update(self, index: int) -> float:
        inputs, ahead = self._drawn(np.random.default_rng([self.settings.seed, index, 0x6120]))
        with torch.autocast("cpu", torch.bfloat16, enabled=self.settings.bfloat16):
            predicted = self._surrogate.network(inputs)
        loss = (predicted[:, COLD_STEPS:].float() - ahead[:, COLD_STEPS:]).square().mean()
        self._optimiser.zero_grad()
        loss.backward()
        torch.nn.utils.clip_grad_norm_(self._surrogate.network.parameters(), 1.0)
        self._optimiser.step()
        self._scheduler.step()
        return float(loss.detach())

    def _drawn(self, rng: np.random.Generator) -> tuple[Tensor, Tensor]:
        """Inputs (b, n, 27), and the readings 1 to H ahead of each row, (b, n, H, 23)."""
        horizon, inputs, ahead = self.settings.horizon, [], []
        for _ in range(self.settings.batch):
            flight = self._inputs[int(rng.integers(len(self._inputs)))]
            start = int(rng.integers(0, len(flight) - SEGMENT - horizon + 1))
            inputs.append(flight[start : start + SEGMENT])
            coming = flight[start + 1 : start + SEGMENT + horizon, :N_CHANNELS]
            ahead.append(coming.unfold(0, horizon, 1).transpose(1, 2))
        return torch.stack(inputs), torch.stack(ahead)

    def summary(self) -> dict[str, Any]:
        """Settings and course of the training, for the card."""
        every = max(1, len(self._losses) // 60)
        return {
            "settings": asdict(self.settings),
            "loss": "mean square over all channels and all steps ahead, in channel deviations",
            "optimiser": "Adam, cosine rate",
            "seconds": round(self._seconds, 1),
            "loss_course": [
                round(float(np.mean(self._losses[start : start + every])), 5)
                for start in range(0, len(self._losses), every)
            ],
        }

    def resume(self, checkpoint: Path) -> None:
        """Keep checkpoints at that path, and go on from the one there if it is of this training."""
        self._checkpoint = checkpoint
        state = read_checkpoint(checkpoint, self._identity)
        if state is None:
            return
        self._surrogate.network.load_state_dict(state["network"])
        self._optimiser.load_state_dict(state["optimiser"])
        self._scheduler.load_state_dict(state["scheduler"])
        self._losses, self._seconds = state["losses"], state["seconds"]

    def _save(self) -> None:
        if self._checkpoint is None:
            return
        state = {
            "network": self._surrogate.network.state_dict(),
            "optimiser": self._optimiser.state_dict(),
            "scheduler": self._scheduler.state_dict(),
            "losses": self._losses,
            "seconds": self._seconds,
        }
        write_checkpoint(self._checkpoint, self._identity, state)
