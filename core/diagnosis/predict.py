"""Diagnosis of a flight: window by window as it goes on, and the verdict at the end."""

from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Literal, Self

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn

from core.diagnosis.card import Card, load_model
from core.diagnosis.diagnosis import Diagnosis
from core.diagnosis.evidence import find_evidence
from core.diagnosis.features import FEATURE_MODES, N_FEATURES, FeatureMode, Normalisation
from core.diagnosis.networks import CLASSIFIERS
from core.errors import InputError
from core.paths import MODELS
from core.residual.window import EFFECTIVE_S, STRIDE_STEPS, WINDOW_S, WINDOW_STEPS
from core.twin.plan import DT_S
from core.twin.trajectory import Array, Array32, Pair, Trajectory

TIME_TOLERANCE_S = DT_S / 2


def verdict(time_s: Array, probabilities: Array32, onset_s: float | None) -> Array32:
    """The run's class probabilities, (c,), from those of its windows, (k, c).

    ``time_s``: (k,) window ends. The windows that lie wholly within the effective window, onset to
    onset + 120 s, are averaged; where the flight ends before one is complete, those that reach
    furthest beyond the onset. Without an onset all count alike.
    """
    if onset_s is None:
        chosen = np.ones(len(time_s), dtype=bool)
    else:
        begins_after = time_s - WINDOW_S >= onset_s - TIME_TOLERANCE_S
        chosen = begins_after & (time_s <= onset_s + EFFECTIVE_S + TIME_TOLERANCE_S)
        if not chosen.any():
            chosen = np.arange(len(time_s)) == _latest(time_s, onset_s)
    mean: Array32 = probabilities[chosen].mean(axis=0, dtype=np.float64).astype(np.float32)
    return mean


def _latest(time_s: Array, onset_s: float) -> int:
    """The last window that ends within the effective window, else simply the last one."""
    within = np.flatnonzero(time_s <= onset_s + EFFECTIVE_S + TIME_TOLERANCE_S)
    return int(within[-1]) if len(within) else len(time_s) - 1


@dataclass(frozen=True, slots=True, eq=False)
class Diagnoser:
    """A trained network with what it needs to read a flight.

    ``classes``: the 20 ids in catalogue order. ``conditions``: those that it was trained for.
    """

    name: str
    classes: tuple[str, ...]
    conditions: str
    mode: FeatureMode
    normalisation: Normalisation
    network: nn.Module

    @classmethod
    def from_card(cls, card: Card, weights: dict[str, Tensor]) -> Self:
        """The model that a card describes, ready to predict."""
        classes = tuple(card["classes"])
        network = CLASSIFIERS[card["classifier"]](N_FEATURES, len(classes))
        network.load_state_dict(weights)
        return cls(
            name=card["name"],
            classes=classes,
            conditions=card["conditions"],
            mode=FEATURE_MODES[card["feature_mode"]],
            normalisation=Normalisation.from_dict(card["normalisation"]),
            network=network.eval(),
        )

    def window(self, pair_window: Pair) -> NDArray[np.float32]:
        """Class probabilities, (20,), of one 30 s window of 1,500 samples."""
        features = self.normalisation.features(
            self.mode.residual(pair_window), pair_window.faulted.channels
        )
        with torch.inference_mode():
            logits = self.network(torch.from_numpy(features)[None])
            probabilities: NDArray[np.float32] = torch.softmax(logits[0], dim=0).numpy()
        return probabilities

    def diagnose(self, pair: Pair) -> Diagnosis:
        """The whole run; raises `InputError` if it is shorter than one window."""
        stream = self.stream()
        stream.push(pair)
        return stream.finish()

    def stream(self) -> "StreamingDiagnoser":
        """A diagnosis that follows a flight block by block."""
        return StreamingDiagnoser(self)


class StreamingDiagnoser:
    """Follows a flight: a window every 5 s once 30 s have flown, the verdict at the end.

    However the flight is cut into blocks, the same windows are read and `finish` gives the same
    `Diagnosis`; nothing but the two sensor logs is looked at.
    """

    def __init__(self, diagnoser: Diagnoser) -> None:
        """Start at the first sample of a flight."""
        self._diagnoser = diagnoser
        self._blocks: list[Pair] = []
        self._recent: Pair | None = None
        self._time_s: list[float] = []
        self._probabilities: list[NDArray[np.float32]] = []

    def push(self, block: Pair) -> list[tuple[float, NDArray[np.float32]]]:
        """Take the next samples; returns (end time, probabilities (20,)) of each window completed.

        A window's end is the time at which its last sample's step ends: 30.0 s for the first.
        """
        block = _channels_only(block)
        self._blocks.append(block)
        recent = block if self._recent is None else _joined([self._recent, block])
        completed = []
        while len(recent.faulted) >= WINDOW_STEPS:
            window = recent[:WINDOW_STEPS]
            end_s = round(float(window.faulted.time_s[-1]) + DT_S, 3)
            completed.append((end_s, self._diagnoser.window(window)))
            recent = recent[STRIDE_STEPS:]
        self._recent = recent
        self._time_s += [end_s for end_s, _ in completed]
        self._probabilities += [probabilities for _, probabilities in completed]
        return completed

    def finish(self) -> Diagnosis:
        """The verdict; raises `InputError` if less than one window has flown."""
        if not self._time_s:
            raise InputError("flight", f"must last at least {WINDOW_S:g} s to be diagnosed")
        evidence, onset_s = find_evidence(_joined(self._blocks))
        time_s = np.array(self._time_s)
        probabilities = np.stack(self._probabilities)
        return Diagnosis(
            classes=self._diagnoser.classes,
            time_s=time_s,
            probabilities_over_time=probabilities,
            probabilities=verdict(time_s, probabilities, onset_s),
            evidence=evidence,
            onset_s=onset_s,
            model=self._diagnoser.name,
            conditions=self._diagnoser.conditions,
        )


def _channels_only(pair: Pair) -> Pair:
    """The pair without its states, which no diagnosis may read (and which need not be kept)."""

    def stripped(flight: Trajectory) -> Trajectory:
        return Trajectory(flight.time_s, np.empty((len(flight), 0)), flight.channels)

    return Pair(stripped(pair.faulted), stripped(pair.mirror))


def _joined(blocks: list[Pair]) -> Pair:
    """Consecutive blocks as one pair."""
    return Pair(
        Trajectory.joined([block.faulted for block in blocks]),
        Trajectory.joined([block.mirror for block in blocks]),
    )


@cache
def load_diagnoser(residual: Literal["paired"] = "paired", models: Path = MODELS) -> Diagnoser:
    """The shipped classifier for that residual, loaded once a process.

    Raises `MirrorTwinError` if its weights or card are missing or do not fit together. PyTorch is
    held to one thread: a window takes 2 ms, and several workers share the machine.
    """
    torch.set_num_threads(1)
    return Diagnoser.from_card(*load_model(models, f"cnn-{residual}-lab"))
