"""The keeper of mystery flights: it alone knows what they hide, and tells when they are over.

    teach/secret                  the server's own, behind every code
    teach/<id>/attempt.json       `core.teach.attempt.Attempt`
    teach/<id>/truth.json         plan, fault, diagnosis, report
    teach/<id>/flight.parquet     both flights

Beside the runs and not among them: until it is over, a mystery flight has no record, no recording
and no report that any page, address or list could show. Then it becomes an ordinary run.
"""

import logging
import secrets
import threading
from collections.abc import Callable
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path

from core.diagnosis.diagnosis import Diagnosis
from core.errors import InputError, MirrorTwinError, StoreError, WorkerError
from core.files import read_json, whole_file, write_error, write_json
from core.fmea.fault import Fault
from core.jobs.worker import RunResult
from core.report.grounded import GroundedReport
from core.store.records import new_run_id, valid_run_id
from core.store.store import RunStore
from core.teach.attempt import Attempt
from core.teach.challenge import Challenge, draw
from core.teach.scoring import Mark, score
from core.twin.flight_file import read_pair, write_pair
from core.twin.plan import Plan
from core.twin.trajectory import Pair, Trajectory

logger = logging.getLogger(__name__)

MAX_SHOWN = 100
"""Attempts looked through for a learner's own, newest first."""

OVER = "this mystery flight is over; reload the page to see what it was"
UNFLOWN = "the mystery flight could not be flown; try again"


@dataclass(frozen=True, slots=True)
class Truth:
    """What a mystery flight hides."""

    plan: Plan
    fault: Fault
    diagnosis: Diagnosis
    report: GroundedReport


class Classroom:
    """All mystery flights of a store. Thread-safe; methods may raise `StoreError`."""

    def __init__(self, store: RunStore, fly: Callable[[Plan, Fault], RunResult]) -> None:
        """Keep them in ``store``'s folder; ``fly`` flies a run without events."""
        self._store = store
        self._fly = fly
        self._root = classroom_root(store)
        self._lock = threading.RLock()

    # -- what anybody may do and see -------------------------------------------------------------

    def start(self, challenge: Challenge, learner: str) -> Attempt:
        """Fly a new mystery; blocks for a second or two. Raises `MirrorTwinError`.

        A learner has one attempt at the flight of a code: the second time the first one is
        returned, so that an answer once seen cannot be given again.
        """
        self._store.check_place()  # else a folder that was removed would come back, with this alone
        if challenge.code is not None:
            for attempt in self.attempts(learner):
                if attempt.challenge == challenge:
                    return attempt
        plan, fault = draw(challenge, self._secret())
        try:
            flown = self._fly(plan, fault)
        except MirrorTwinError as error:
            # What went wrong may name what was flown: for the log, not for the learner.
            logger.warning("a mystery flight could not be flown: %s", error)
            raise WorkerError(UNFLOWN) from None
        attempt = Attempt(new_run_id(), learner, challenge, begun="")
        folder = self._root / attempt.id
        try:
            folder.mkdir(parents=True)
        except OSError as error:
            raise write_error(folder, error) from error
        write_pair(folder / "flight.parquet", flown.pair)
        write_json(
            folder / "truth.json",
            {
                "plan": plan.to_dict(),
                "fault": fault.to_dict(),
                "diagnosis": flown.diagnosis.to_dict(),
                "report": flown.report.to_dict(),
            },
        )
        return self._keep(replace(attempt, begun=_now()))

    def get(self, attempt_id: str) -> Attempt:
        """The attempt of that name; raises `StoreError` if there is none."""
        if not has_attempt(self._store, attempt_id):
            raise StoreError(f"no mystery flight {attempt_id[:40]!r}")
        return _read(self._root / attempt_id)

    def attempts(self, learner: str) -> list[Attempt]:
        """A learner's attempts, newest first."""
        if not self._root.is_dir():
            return []
        folders = sorted((path for path in self._root.iterdir() if path.is_dir()), reverse=True)
        found = []
        for folder in folders[:MAX_SHOWN]:
            if (folder / "attempt.json").exists():  # else it is being flown, or never was
                try:
                    attempt = _read(folder)
                except StoreError as error:
                    logger.warning("left out of the list: %s", error)
                    continue
                if attempt.learner == learner:
                    found.append(attempt)
        return found

    def readings(self, attempt_id: str) -> Trajectory:
        """What the sensors of the flight logged."""
        return self._pair(attempt_id).faulted

    def altitude_and_speed(self, attempt_id: str) -> tuple[float, float]:
        """What the flight holds, in feet and knots: all of its plan that a pilot would know."""
        self.get(attempt_id)
        plan = self._truth(attempt_id).plan
        return plan.altitude_ft, plan.speed_kt

    # -- what an open attempt allows -------------------------------------------------------------

    def mark(self, attempt_id: str, mark: Mark) -> Attempt:
        """Put a mark on a channel; raises `InputError` once it is over."""
        with self._lock:
            return self._keep(self._open(attempt_id).with_mark(mark))

    def unmark(self, attempt_id: str, channel: str) -> Attempt:
        """Take a channel's mark away; raises `InputError` once it is over."""
        with self._lock:
            return self._keep(self._open(attempt_id).without_mark(channel))

    def show_mirror(self, attempt_id: str) -> Attempt:
        """Note that the learner has asked for the mirror, which costs points."""
        with self._lock:
            return self._keep(replace(self._open(attempt_id), mirror_seen=True))

    def submit(self, attempt_id: str, answer: str | None) -> Attempt:
        """End it with an answer, None for giving up: it is scored, and becomes an ordinary run."""
        with self._lock:
            attempt = self._open(attempt_id)
            truth = self._truth(attempt_id)
            attempt = replace(attempt, answer=answer, ended=_now())
            attempt = replace(
                attempt,
                score=score(
                    answer,
                    truth.fault.mode,
                    truth.diagnosis.evidence,
                    attempt.marks,
                    attempt.elapsed_s,
                    mirror_seen=attempt.mirror_seen,
                ),
            )
            # Over first: whatever happens to the run, nobody answers twice.
            self._keep(attempt)
            run_id = self._store.create(truth.plan, truth.fault).id
            self._store.save_pair(run_id, self._pair(attempt_id))
            self._store.save_result(run_id, truth.diagnosis, truth.report)
            return self._keep(replace(attempt, run_id=run_id))

    # -- what is revealed later---------------------------------------------------------------------

    def mirror(self, attempt_id: str) -> Trajectory | None:
        """The healthy mirror, if it has been asked for or the attempt is over."""
        attempt = self.get(attempt_id)
        return self._pair(attempt_id).mirror if attempt.mirror_seen or attempt.over else None

    def truth(self, attempt_id: str) -> Truth:
        """What the flight hid; raises `InputError` as long as it is to be hidden."""
        if not self.get(attempt_id).over:
            raise InputError("mystery", "is still open: answer it first")
        return self._truth(attempt_id)

    # -- inside ----------------------------------------------------------------------------------

    def _open(self, attempt_id: str) -> Attempt:
        attempt = self.get(attempt_id)
        if attempt.over:
            raise InputError("mystery", OVER)
        return attempt

    def _keep(self, attempt: Attempt) -> Attempt:
        write_json(self._root / attempt.id / "attempt.json", attempt.to_dict())
        return attempt

    def _pair(self, attempt_id: str) -> Pair:
        self.get(attempt_id)
        return read_pair(self._root / attempt_id / "flight.parquet")

    def _truth(self, attempt_id: str) -> Truth:
        path = self._root / attempt_id / "truth.json"
        values = read_json(path)
        try:
            return Truth(
                Plan.from_dict(values["plan"]),
                Fault.from_dict(values["fault"]),
                Diagnosis.from_dict(values["diagnosis"]),
                GroundedReport.from_dict(values["report"]),
            )
        except (InputError, KeyError, TypeError, ValueError) as error:
            raise StoreError(f"{path.name} cannot be read by this version") from error

    def _secret(self) -> bytes:
        path = self._root / "secret"
        with self._lock:
            try:
                self._root.mkdir(parents=True, exist_ok=True)
                if not path.exists():
                    with whole_file(path) as temporary:
                        temporary.write_bytes(secrets.token_bytes(32))
                return path.read_bytes()
            except OSError as error:
                raise write_error(self._root, error) from error


def classroom_root(store: RunStore) -> Path:
    """The folder of a store's mystery flights."""
    return store.root / "teach"


def has_attempt(store: RunStore, attempt_id: str) -> bool:
    """Whether a name, as it stands in an address, is that of a mystery flight."""
    return (
        valid_run_id(attempt_id) and (classroom_root(store) / attempt_id / "attempt.json").is_file()
    )


def _read(folder: Path) -> Attempt:
    values = read_json(folder / "attempt.json")
    try:
        return Attempt.from_dict(values)
    except (InputError, KeyError, TypeError, ValueError) as error:
        raise StoreError(f"attempt {folder.name} cannot be read by this version") from error


def _now() -> str:
    return datetime.now(UTC).isoformat(timespec="milliseconds")
