"""Diagnosis of a flight: window by window while it is flown, and the verdict at the end."""

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Literal, Self

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn

from core.arrays import Array32
from core.clock import DT_S
from core.diagnosis.calibration import Calibration
from core.diagnosis.diagnosis import Diagnosis, Intervention, judged_until
from core.diagnosis.features import (
    FeatureMode,
    Inputs,
    Normalisation,
    feature_mode,
    n_features,
)
from core.diagnosis.findings import FieldFindings, Findings, MirrorFindings, SurrogateFindings
from core.diagnosis.networks import NETWORKS
from core.diagnosis.verdict import counted_windows, verdict_until
from core.errors import InputError
from core.model_card import Card, load_model, unreadable
from core.paths import MODELS
from core.residual.healthy import load_healthy
from core.residual.readers import FieldReader, KnownReader, MirrorReader, SurrogateReader
from core.residual.surrogate import Surrogate
from core.residual.window import STRIDE_STEPS, WINDOW_S, WINDOW_STEPS
from core.twin.plan import Conditions, Plan
from core.twin.trajectory import Pair, Trajectory

Residual = Literal["paired", "surrogate"]
"""The two ways that the product offers: by flying a mirror, or by predicting the next reading."""

UNCALIBRATED = Calibration()


@dataclass(frozen=True, slots=True, eq=False)
class Diagnoser:
    """A trained network with what it needs to read a flight.

    ``classes``: the ids in catalogue order. ``conditions``: those that it was trained for.
    ``inputs``: the half of the 46 channels that it sees. ``surrogate`` where its mode needs one.
    """

    name: str
    classes: tuple[str, ...]
    conditions: str
    mode: FeatureMode
    normalisation: Normalisation
    network: nn.Module
    inputs: Inputs = "both"
    calibration: Calibration = UNCALIBRATED
    surrogate: Surrogate | None = None

    @classmethod
    def from_card(
        cls, card: Card, weights: dict[str, Tensor], surrogate: Surrogate | None = None
    ) -> Self:
        """The model that a card describes, ready to predict.

        Raises `MirrorTwinError` if the card is of another version or another surrogate.
        """
        try:
            return cls._read(card, weights, surrogate)
        except (KeyError, TypeError, ValueError, AttributeError, RuntimeError) as error:
            raise unreadable(card, error) from None

    @classmethod
    def _read(cls, card: Card, weights: dict[str, Tensor], surrogate: Surrogate | None) -> Self:
        classes = tuple(card["classes"])
        inputs: Inputs = card.get("inputs", "both")
        network = NETWORKS[card["classifier"]](n_features(inputs), len(classes))
        network.load_state_dict(weights)
        mode = feature_mode(card["feature_mode"], card["conditions"])
        if mode.residual is not None:
            surrogate = None
        elif surrogate is None or surrogate.fingerprint != card["surrogate"]["fingerprint"]:
            raise ValueError(f"it was trained with another surrogate {card['surrogate']['name']}")
        calibration = card.get("calibration", {})
        return cls(
            name=card["name"],
            classes=classes,
            conditions=card["conditions"],
            mode=mode,
            normalisation=Normalisation.from_dict(card["normalisation"]),
            network=network.eval(),
            inputs=inputs,
            calibration=Calibration(
                calibration.get("temperature", 1.0), calibration.get("energy_threshold", np.inf)
            ),
            surrogate=surrogate,
        )

    def logits(self, residual: Array32, sensors: Array32) -> NDArray[np.float32]:
        """The network's answer, (20,), to one 30 s window: (1500, 23) residuals and sensors."""
        features = self.normalisation.features(residual, sensors, self.inputs)
        with torch.inference_mode():
            answer: NDArray[np.float32] = self.network(torch.from_numpy(features)[None])[0].numpy()
        return answer

    def diagnose(
        self,
        pair: Pair,
        plan: Plan | None = None,
        residual: Array32 | None = None,
        interventions: Iterable[Intervention] = (),
    ) -> Diagnosis:
        """The whole run; raises `InputError` as `stream` and `StreamingDiagnoser.finish` do.

        ``residual``, (n, 23), is the surrogate's for this pair, where it is known already.
        """
        if residual is not None and self.surrogate is not None:
            known = KnownReader(residual)
            stream = StreamingDiagnoser(self, SurrogateFindings(self.surrogate, known))
        else:
            stream = self.stream(plan)
        stream.push(pair)
        return stream.finish(interventions)

    def stream(self, plan: Plan | None = None) -> "StreamingDiagnoser":
        """A diagnosis that follows a flight block by block.

        ``plan`` is what was commanded: a surrogate needs it, a mirror does not. Raises
        `InputError` if it is needed and not given.
        """
        return StreamingDiagnoser(self, self._findings(plan))

    def _findings(self, plan: Plan | None) -> Findings:
        if self.mode.residual is not None:
            if self.mode.debiased:
                return FieldFindings(FieldReader(self.mode.residual, load_healthy()))
            return MirrorFindings(MirrorReader(self.mode.residual))
        assert self.surrogate is not None  # see `from_card`
        if plan is None:
            raise InputError("plan", "the surrogate has to know what was commanded")
        return SurrogateFindings(self.surrogate, SurrogateReader(self.surrogate, plan))


class StreamingDiagnoser:
    """Follows a flight: a window every 5 s once 30 s have flown, the verdict at the end.

    However the flight is cut into blocks, the same windows are read and `finish` gives the same
    `Diagnosis`; nothing but the two sensor logs is looked at.
    """

    def __init__(self, diagnoser: Diagnoser, findings: Findings) -> None:
        """Start at the first sample of a flight."""
        self._diagnoser = diagnoser
        self._findings = findings
        self._reader = findings.reader
        self._blocks: list[Pair] = []
        self._recent: Pair | None = None
        self._time_s: list[float] = []
        self._logits: list[NDArray[np.float32]] = []

    def push(self, block: Pair) -> list[tuple[float, NDArray[np.float32]]]:
        """Take the next samples; returns (end time, probabilities (20,)) of each window completed.

        A window's end is the time at which its last sample's step ends: 30.0 s for the first.
        """
        block = _channels_only(block)
        self._blocks.append(block)
        self._reader.push(block)
        recent = block if self._recent is None else Pair.joined([self._recent, block])
        completed = []
        while len(recent.faulted) >= WINDOW_STEPS:
            window = recent[:WINDOW_STEPS]
            residual = self._reader.window(len(self._time_s) * STRIDE_STEPS, window)
            logits = self._diagnoser.logits(residual, window.faulted.channels)
            self._time_s.append(round(float(window.faulted.time_s[-1]) + DT_S, 3))
            self._logits.append(logits)
            completed.append((self._time_s[-1], self._diagnoser.calibration.probabilities(logits)))
            recent = recent[STRIDE_STEPS:]
        self._recent = recent
        return completed

    def finish(self, interventions: Iterable[Intervention] = ()) -> Diagnosis:
        """The verdict; raises `InputError` if less than one window has flown.

        ``interventions``: what was done on the way, in any order.
        """
        if not self._time_s:
            raise InputError("flight", f"must last at least {WINDOW_S:g} s to be diagnosed")
        done = tuple(sorted(interventions, key=lambda item: item.time_s))
        flight = Pair.joined(self._blocks)
        onset_s = self._findings.onset(flight)
        time_s = np.array(self._time_s)
        calibration = self._diagnoser.calibration
        logits = np.stack(self._logits)
        probabilities = calibration.probabilities(logits)
        counted = counted_windows(time_s, onset_s, verdict_until(time_s, onset_s, done))
        energy = float(calibration.energy(logits)[counted].mean())
        return Diagnosis(
            classes=self._diagnoser.classes,
            time_s=time_s,
            probabilities_over_time=probabilities,
            probabilities=probabilities[counted].mean(axis=0, dtype=np.float64).astype(np.float32),
            evidence=self._findings.evidence(flight, judged_until(onset_s, done)),
            onset_s=onset_s,
            model=self._diagnoser.name,
            conditions=self._diagnoser.conditions,
            none_of_these=energy > calibration.threshold,
            energy=energy,
            interventions=done,
        )


def _channels_only(pair: Pair) -> Pair:
    """The pair without its states, which no diagnosis may read (and which need not be kept)."""

    def stripped(flight: Trajectory) -> Trajectory:
        return Trajectory(flight.time_s, np.empty((len(flight), 0)), flight.channels)

    return Pair(stripped(pair.faulted), stripped(pair.mirror))


@cache
def load_diagnoser(
    residual: Residual = "paired", models: Path = MODELS, conditions: Conditions = "lab"
) -> Diagnoser:
    """The shipped 1D-CNN for that residual and those conditions, loaded once a process.

    Raises `MirrorTwinError` if its weights or card are missing, of another version, or do not fit
    together. PyTorch is held to one thread: a window takes 2 ms, and several workers share the
    machine.
    """
    torch.set_num_threads(1)
    card, weights = load_model(models, f"cnn-{residual}-{conditions}")
    surrogate = load_surrogate(conditions, models) if residual == "surrogate" else None
    return Diagnoser.from_card(card, weights, surrogate)


@cache
def load_surrogate(conditions: Conditions = "lab", models: Path = MODELS) -> Surrogate:
    """The shipped surrogate for those conditions, loaded once a process.

    Raises `MirrorTwinError` if its weights or card are missing, of another version, or do not fit
    together.
    """
    return Surrogate.from_card(*load_model(models, f"gru-{conditions}"))
