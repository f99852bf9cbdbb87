"""Diagnosis of a flight: window by window as it goes on, and the verdict at the end."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Literal, Protocol, Self

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn

from core.arrays import Array, Array32
from core.channels import N_CHANNELS
from core.clock import DT_S
from core.diagnosis.calibration import Calibration
from core.diagnosis.diagnosis import Diagnosis, Evidence, Intervention, judged_until
from core.diagnosis.evidence import find_evidence, find_field_evidence, find_surrogate_evidence
from core.diagnosis.features import (
    FeatureMode,
    Inputs,
    Normalisation,
    feature_mode,
    n_features,
)
from core.diagnosis.networks import NETWORKS
from core.errors import InputError, MirrorTwinError
from core.model_card import Card, load_model
from core.paths import MODELS
from core.residual.controls import controls
from core.residual.departure import DepartureTest
from core.residual.healthy import STEP_S, STEP_SAMPLES, HealthyResidual, load_healthy, steps
from core.residual.paired import first_departure
from core.residual.surrogate import Surrogate, debiased
from core.residual.window import EFFECTIVE_S, STRIDE_STEPS, WINDOW_S, WINDOW_STEPS
from core.twin.plan import Conditions, Plan
from core.twin.trajectory import Pair, Trajectory

Residual = Literal["paired", "surrogate"]
"""The two ways that the product offers: by flying a mirror, or by predicting the next reading."""

UNCALIBRATED = Calibration()

TIME_TOLERANCE_S = DT_S / 2

BASELINE_STEPS = WINDOW_STEPS // STEP_SAMPLES
BASELINE_LEAD_STEPS = round(60.0 / STEP_S)
"""How long before a window the baseline of a flight ends that has not departed from anything."""


def counted_windows(
    time_s: Array, onset_s: float | None, until_s: float | None = None
) -> NDArray[np.bool_]:
    """Which windows, by their ends (k,), make the verdict.

    Those that lie wholly within the effective window, onset to onset + 120 s, and end by
    ``until_s``; where none is complete by then, the one that reaches furthest beyond the onset.
    Without an onset all.
    """
    if onset_s is None:
        return np.ones(len(time_s), dtype=bool)
    last_s = onset_s + EFFECTIVE_S
    if until_s is not None:
        last_s = min(last_s, until_s)
    begins_after = time_s - WINDOW_S >= onset_s - TIME_TOLERANCE_S
    chosen: NDArray[np.bool_] = begins_after & (time_s <= last_s + TIME_TOLERANCE_S)
    if not chosen.any():
        chosen = np.arange(len(time_s)) == _latest(time_s, last_s)
    return chosen


def _latest(time_s: Array, last_s: float) -> int:
    """The last window that ends by ``last_s``, else simply the last one."""
    within = np.flatnonzero(time_s <= last_s + TIME_TOLERANCE_S)
    return int(within[-1]) if len(within) else len(time_s) - 1


def _verdict_until(
    time_s: Array, onset_s: float | None, interventions: Sequence[Intervention]
) -> float | None:
    """Where the verdict's windows end: at the repair, and before new targets if one fits there.

    While both aircraft fly to new targets their difference is the fault's still, but not one that
    any model has learnt.
    """
    until_s = judged_until(onset_s, interventions)
    if onset_s is None:
        return None
    targets = [item.time_s for item in interventions if item.kind == "target"]
    steered_s = min((each for each in targets if each > onset_s), default=None)
    if steered_s is None or (until_s is not None and until_s <= steered_s):
        return until_s
    whole = (time_s - WINDOW_S >= onset_s - TIME_TOLERANCE_S) & (time_s <= steered_s)
    return steered_s if whole.any() else until_s


class ResidualReader(Protocol):
    """How a diagnosis gets at residuals while a flight goes on."""

    def push(self, block: Pair) -> None:
        """Take the next samples."""

    def window(self, start_row: int, window: Pair) -> Array32:
        """Residuals (1500, 23) of a window that begins at ``start_row`` of what was pushed."""

    def onset(self, pair: Pair) -> float | None:
        """Estimated onset of the whole flight in seconds; None where it departs from nothing."""

    def evidence(self, pair: Pair, until_s: float | None) -> tuple[Evidence, ...]:
        """Evidence of the whole flight, as far as ``until_s``."""


@dataclass(frozen=True, slots=True, eq=False)
class Diagnoser:
    """A trained network with what it needs to read a flight.

    ``classes``: the 20 ids in catalogue order. ``conditions``: those that it was trained for.
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
            told = str(error).splitlines()[0] if str(error) else ""
            raise MirrorTwinError(
                f"model {card.get('name', '?')}: its card is not one that this version can read "
                f"({type(error).__name__}: {told}); train it again with `mirrortwin train`"
            ) from None

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
            stream = StreamingDiagnoser(self, _KnownReader(self.surrogate, residual))
        else:
            stream = self.stream(plan)
        stream.push(pair)
        return stream.finish(interventions)

    def stream(self, plan: Plan | None = None) -> "StreamingDiagnoser":
        """A diagnosis that follows a flight block by block.

        ``plan`` is what was commanded: a surrogate needs it, a mirror does not. Raises
        `InputError` if it is needed and not given.
        """
        return StreamingDiagnoser(self, self._reader(plan))

    def _reader(self, plan: Plan | None) -> ResidualReader:
        if self.mode.residual is not None:
            if self.mode.debiased:
                return _FieldReader(self.mode, load_healthy())
            return _MirrorReader(self.mode)
        assert self.surrogate is not None  # see `from_card`
        if plan is None:
            raise InputError("plan", "the surrogate has to know what was commanded")
        return _SurrogateReader(self.surrogate, plan)


class _MirrorReader:
    """Residuals of an exact mirror: a window tells its own."""

    def __init__(self, mode: FeatureMode) -> None:
        assert mode.residual is not None
        self._residual = mode.residual

    def push(self, block: Pair) -> None:
        """Nothing to remember."""

    def window(self, start_row: int, window: Pair) -> Array32:
        return self._residual(window)

    def onset(self, pair: Pair) -> float | None:
        first = first_departure(pair.residual)
        return None if first is None else float(pair.faulted.time_s[first])

    def evidence(self, pair: Pair, until_s: float | None) -> tuple[Evidence, ...]:
        return find_evidence(pair, until_s)[0]


class _FieldReader:
    """Residuals of a mirror that is only roughly this aircraft in this air.

    They are taken from their mean over 30 s that are held to be healthy: those before the
    departure from what healthy flights do, once one is found. Until then those that ended a
    minute before the window begins: models have seen windows that far from their baseline, and
    healthy flights drift.
    """

    def __init__(self, mode: FeatureMode, healthy: HealthyResidual) -> None:
        assert mode.residual is not None
        self._residual = mode.residual
        self._healthy = healthy
        self._test = DepartureTest(healthy)
        self._waiting = np.empty((0, 2 * N_CHANNELS), dtype=np.float32)
        self._steps = np.empty((0, 2 * N_CHANNELS))

    def push(self, block: Pair) -> None:
        rows = np.concatenate([self._residual(block), block.mirror.channels], axis=1)
        self._waiting = np.concatenate([self._waiting, rows])
        means = steps(self._waiting)
        self._waiting = self._waiting[len(means) * STEP_SAMPLES :]
        self._steps = np.concatenate([self._steps, means])

    def window(self, start_row: int, window: Pair) -> Array32:
        start = start_row // STEP_SAMPLES
        self._test_until(start + WINDOW_STEPS // STEP_SAMPLES)
        departure = self._test.found
        end = start - BASELINE_LEAD_STEPS
        if departure is not None and start + BASELINE_STEPS >= departure.onset_s / STEP_S:
            end = round(departure.onset_s / STEP_S)
        end = max(end, BASELINE_STEPS)
        usual = self._steps[end - BASELINE_STEPS : end, :N_CHANNELS].mean(axis=0)
        residual: Array32 = self._residual(window) - usual.astype(np.float32)
        return residual

    def _test_until(self, step: int) -> None:
        """Test up to there and no further, however much has been pushed."""
        for number in range(self._test.n_steps, min(step, len(self._steps))):
            residual, mirror = np.split(self._steps[number], 2)
            self._test.push(residual, mirror)

    def onset(self, pair: Pair) -> float | None:
        self._test_until(len(self._steps))
        departure = self._test.finish()
        return None if departure is None else departure.onset_s

    def evidence(self, pair: Pair, until_s: float | None) -> tuple[Evidence, ...]:
        departure = self._test.finish()
        return find_field_evidence(
            self._residual(pair), departure, self._healthy, self._test.air, until_s
        )[0]


class _KnownReader:
    """Residuals of the surrogate that were computed before."""

    def __init__(self, surrogate: Surrogate, residual: Array32) -> None:
        self._surrogate = surrogate
        self._residual = residual

    def push(self, block: Pair) -> None:
        """Nothing to compute."""

    def window(self, start_row: int, window: Pair) -> Array32:
        return self._residual[start_row : start_row + WINDOW_STEPS]

    def onset(self, pair: Pair) -> float | None:
        return find_surrogate_evidence(self._residual, pair.faulted.time_s, self._surrogate)[1]

    def evidence(self, pair: Pair, until_s: float | None) -> tuple[Evidence, ...]:
        time_s = pair.faulted.time_s
        return find_surrogate_evidence(self._residual, time_s, self._surrogate, until_s)[0]


class _SurrogateReader:
    """Residuals of the surrogate, which follows the flight; the mirror is never looked at."""

    def __init__(self, surrogate: Surrogate, plan: Plan) -> None:
        self._surrogate = surrogate
        self._plan = plan
        self._stream = surrogate.stream()
        self._smoothed: list[Array32] = []

    def push(self, block: Pair) -> None:
        flight = block.faulted
        if not len(flight):
            return
        commanded = controls(self._plan, round(float(flight.time_s[0]) / DT_S), len(flight))
        self._smoothed.append(self._stream.push(flight.channels, commanded))

    def window(self, start_row: int, window: Pair) -> Array32:
        self._smoothed = [np.concatenate(self._smoothed)]
        smoothed = self._smoothed[0]
        return debiased(smoothed)[start_row : start_row + WINDOW_STEPS]

    def onset(self, pair: Pair) -> float | None:
        return self._found(pair, None)[1]

    def evidence(self, pair: Pair, until_s: float | None) -> tuple[Evidence, ...]:
        return self._found(pair, until_s)[0]

    def _found(
        self, pair: Pair, until_s: float | None
    ) -> tuple[tuple[Evidence, ...], float | None]:
        residual = debiased(np.concatenate(self._smoothed))
        return find_surrogate_evidence(residual, pair.faulted.time_s, self._surrogate, until_s)


class StreamingDiagnoser:
    """Follows a flight: a window every 5 s once 30 s have flown, the verdict at the end.

    However the flight is cut into blocks, the same windows are read and `finish` gives the same
    `Diagnosis`; nothing but the two sensor logs is looked at.
    """

    def __init__(self, diagnoser: Diagnoser, reader: ResidualReader) -> None:
        """Start at the first sample of a flight."""
        self._diagnoser = diagnoser
        self._reader = reader
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
        recent = block if self._recent is None else _joined([self._recent, block])
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
        flight = _joined(self._blocks)
        onset_s = self._reader.onset(flight)
        time_s = np.array(self._time_s)
        calibration = self._diagnoser.calibration
        logits = np.stack(self._logits)
        probabilities = calibration.probabilities(logits)
        counted = counted_windows(time_s, onset_s, _verdict_until(time_s, onset_s, done))
        energy = float(calibration.energy(logits)[counted].mean())
        return Diagnosis(
            classes=self._diagnoser.classes,
            time_s=time_s,
            probabilities_over_time=probabilities,
            probabilities=probabilities[counted].mean(axis=0, dtype=np.float64).astype(np.float32),
            evidence=self._reader.evidence(flight, judged_until(onset_s, done)),
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


def _joined(blocks: list[Pair]) -> Pair:
    """Consecutive blocks as one pair."""
    return Pair(
        Trajectory.joined([block.faulted for block in blocks]),
        Trajectory.joined([block.mirror for block in blocks]),
    )


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
