"""What a run tells while it is flown: plain values that travel from worker to browser.

The usual order is Progress("waiting"), Started, then Progress, Samples and Probabilities as the
flight goes on, Diagnosed, Reported, and one of Finished, Failed and Cancelled, which is the last.
A Started with attempt 2 says that the first worker died: what came before it is void, and samples
count from 0 again. A live flight also tells Paced and Acted, whenever it is steered.
"""

import time
from dataclasses import dataclass, field
from typing import Literal

from core.arrays import Array32
from core.diagnosis.diagnosis import Diagnosis
from core.jobs.extremes import none_yet
from core.report.grounded import GroundedReport
from core.twin.actions import Action

Stage = Literal["waiting", "no_worker", "flying", "diagnosing", "reporting", "storing"]

SAMPLE_STRIDE = 10
"""Every 10th of the 50 Hz samples is streamed: 5 Hz."""


@dataclass(frozen=True, slots=True)
class Started:
    """A worker has started; ``attempt`` counts from 1."""

    run_id: str
    attempt: int


@dataclass(frozen=True, slots=True)
class Progress:
    """Where the run is: ``fraction`` 0-1 of the whole run, not of the stage."""

    run_id: str
    stage: Stage
    fraction: float


@dataclass(frozen=True, slots=True)
class Paced:
    """A live flight goes at that pace: seconds of it in one, infinite for as fast as possible."""

    run_id: str
    pace: float
    is_paused: bool


@dataclass(frozen=True, slots=True)
class Acted:
    """All that has been done during a live flight or is still to be, in the order of asking.

    It comes when an action is asked for, and again, with the time at which it really takes effect,
    before the first samples that show it.
    """

    run_id: str
    actions: tuple[Action, ...]


@dataclass(frozen=True, slots=True, eq=False)
class Samples:
    """The next k samples at 5 Hz, of both flights; the one at t = 0 is included.

    ``index`` is the number of 5 Hz samples before these. ``time_s``: (k,). ``faulted`` and
    ``mirror``: (k, 23) in `core.channels.CHANNELS` order and units. ``faulted_states`` and
    ``mirror_states``: (k, S) in `core.twin.trajectory.STATE_NAMES` order. All float32.
    ``flown_at_s``: when the first of them left the flight, in Unix time of the worker's clock.
    ``extremes``: (3, 23, s, 6), of the s seconds that ended with these at 50 Hz, what
    `core.jobs.extremes` keeps; nothing else that happens between two samples is told.
    """

    run_id: str
    index: int
    time_s: Array32
    faulted: Array32
    mirror: Array32
    faulted_states: Array32
    mirror_states: Array32
    flown_at_s: float = field(default_factory=time.time)
    extremes: Array32 = field(default_factory=none_yet)


@dataclass(frozen=True, slots=True, eq=False)
class Probabilities:
    """The classifier's answer for the 30 s window that ends at ``time_s``: (20,) float32."""

    run_id: str
    time_s: float
    probabilities: Array32


@dataclass(frozen=True, slots=True, eq=False)
class Diagnosed:
    """The verdict on the whole run."""

    run_id: str
    diagnosis: Diagnosis


@dataclass(frozen=True, slots=True)
class Reported:
    """The report on the diagnosis, each sentence checked."""

    run_id: str
    report: GroundedReport


@dataclass(frozen=True, slots=True)
class Finished:
    """All done, and in the store."""

    run_id: str


@dataclass(frozen=True, slots=True)
class Failed:
    """It came to nothing; ``message`` is for the user. ``retryable``: running again may help."""

    run_id: str
    message: str
    retryable: bool


@dataclass(frozen=True, slots=True)
class Cancelled:
    """The user stopped it."""

    run_id: str


FinalEvent = Finished | Failed | Cancelled
Event = (
    Started | Progress | Paced | Acted | Samples | Probabilities | Diagnosed | Reported | FinalEvent
)
