"""What a diagnosis says: probabilities over time, the verdict and the evidence for it."""

from collections.abc import Iterable
from dataclasses import asdict, dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from core.arrays import Array32

InterventionKind = Literal["repair", "target", "ground"]


@dataclass(frozen=True, slots=True)
class Evidence:
    """One channel that left its mirror: where, how far, which way.

    It was outside its band from ``start_s`` to ``end_s``. ``value``, in ``unit``, is what it came
    to: the mean residual over the last 30 s of that, or over all of it where the channel was back
    before the end. ``settled_s`` is when it had come there, None where it still moves or came
    back. ``sigma`` is the value in standard deviations of what healthy flights do by themselves
    (in lab, of the sensor's noise); ``onset_s`` when it first left the band.
    """

    channel: str
    start_s: float
    end_s: float
    value: float
    unit: str
    direction: Literal["+", "-"]
    sigma: float
    onset_s: float
    settled_s: float | None = None

    def to_dict(self) -> dict[str, Any]:
        """Plain JSON-ready values."""
        return asdict(self)


@dataclass(frozen=True, slots=True)
class Intervention:
    """What everybody in the hangar knows of a flight: repairs, new targets, an end on the ground.

    An injected fault is none: a diagnosis must not know it. ``targets`` is what the crew was given.
    """

    time_s: float
    kind: InterventionKind
    targets: str = ""

    def to_dict(self) -> dict[str, Any]:
        """Plain JSON-ready values."""
        return asdict(self)


@dataclass(frozen=True, slots=True, eq=False)
class Diagnosis:
    """Class probabilities of one run.

    ``time_s``: (k,) end of each 30 s window; ``probabilities_over_time``: (k, 20);
    ``probabilities``: (20,) the verdict over the effective window; ``classes``: their ids.
    ``onset_s`` is the estimated onset, None where nothing left the noise. ``none_of_these`` says
    that the flight resembles nothing that the model has learnt, so that its verdict counts little;
    it goes by ``energy``, the mean over the windows that the verdict is made of.
    ``interventions`` are what was done on the way, in order; nothing after the first repair that
    follows the onset is evidence.
    """

    classes: tuple[str, ...]
    time_s: NDArray[np.float64]
    probabilities_over_time: Array32
    probabilities: Array32
    evidence: tuple[Evidence, ...]
    onset_s: float | None
    model: str
    conditions: str
    none_of_these: bool = False
    energy: float | None = None
    interventions: tuple[Intervention, ...] = ()

    @property
    def judged_until_s(self) -> float | None:
        """When the engine was repaired, from which on nothing counts; None if it was not."""
        return judged_until(self.onset_s, self.interventions)

    @property
    def top(self) -> str:
        """The most probable class."""
        return self.classes[int(np.argmax(self.probabilities))]

    def ranked(self, k: int = 3) -> list[tuple[str, float]]:
        """The k most probable classes with their probabilities, best first."""
        order = np.argsort(-self.probabilities, kind="stable")[:k]
        return [(self.classes[int(i)], float(self.probabilities[int(i)])) for i in order]

    def to_dict(self) -> dict[str, Any]:
        """The JSON form printed by ``mirrortwin diagnose --json`` and kept in the store."""
        return {
            "top": self.top,
            "probabilities": dict(zip(self.classes, map(float, self.probabilities), strict=True)),
            "evidence": [item.to_dict() for item in self.evidence],
            "onset_s": self.onset_s,
            "model": self.model,
            "conditions": self.conditions,
            "none_of_these": self.none_of_these,
            "energy": self.energy,
            "interventions": [item.to_dict() for item in self.interventions],
            "over_time": {
                "time_s": [float(t) for t in self.time_s],
                "probabilities": [[float(p) for p in row] for row in self.probabilities_over_time],
            },
        }

    @classmethod
    def from_dict(cls, values: dict[str, Any]) -> "Diagnosis":
        """Read what `to_dict` wrote."""
        over_time = values["over_time"]
        classes = tuple(values["probabilities"])
        return cls(
            classes=classes,
            time_s=np.asarray(over_time["time_s"], dtype=np.float64),
            probabilities_over_time=np.asarray(
                over_time["probabilities"], dtype=np.float32
            ).reshape(-1, len(classes)),
            probabilities=np.asarray(list(values["probabilities"].values()), dtype=np.float32),
            evidence=tuple(Evidence(**item) for item in values["evidence"]),
            onset_s=values["onset_s"],
            model=values["model"],
            conditions=values["conditions"],
            none_of_these=values.get("none_of_these", False),
            energy=values.get("energy"),
            interventions=tuple(Intervention(**item) for item in values.get("interventions", ())),
        )


def judged_until(onset_s: float | None, interventions: Iterable[Intervention]) -> float | None:
    """The first repair after the onset, if any: what follows it is no longer the fault's."""
    if onset_s is None:
        return None
    repairs = [item.time_s for item in interventions if item.kind == "repair"]
    return min((time_s for time_s in repairs if time_s > onset_s), default=None)
