"""The data set: which flights are flown for it, and the flying of them (paper section 3.3)."""

from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import asdict, dataclass, fields, replace
from itertools import islice
from pathlib import Path
from typing import Any, Literal, Self

import numpy as np
from distributed import Client, Future, KilledWorker, as_completed

from core.arrays import Array32
from core.checks import checked_number
from core.clock import DT_S
from core.cylinders import N_CYLINDERS
from core.dataset.archive import Archive, Manifest, StoredRun
from core.errors import InputError, WorkerError
from core.files import read_toml
from core.fmea.catalogue import Mode, catalogue, class_ids
from core.fmea.fault import Fault
from core.paths import DATA
from core.residual.paired import first_departure
from core.residual.window import EFFECTIVE_STEPS, STRIDE_STEPS, WINDOW_STEPS
from core.twin.flight import fly, fly_pair
from core.twin.plan import PLAN_RANGES, Conditions, Plan
from core.twin.trajectory import Pair
from core.workers.pool import await_workers, pool_client
from core.workers.remote import remote_client
from core.workers.scheduler import RemoteScheduler

Split = Literal["train", "validation", "test"]
SPEC_PATH = DATA / "dataset.toml"

IN_FLIGHT_PER_WORKER = 2
"""Runs handed to the cluster ahead of their turn: enough to keep it busy, few enough to hold."""


SOON_S = 15.0
"""Most faults show within so long after their onset."""


@dataclass(frozen=True, slots=True)
class DatasetSpec:
    """What is flown (``assets/data/dataset.toml``); raises `InputError` for values out of range."""

    runs_per_class: int = 80
    first_seed: int = 1_000_000_000
    conditions: Conditions = "lab"
    duration_s: float = 300.0
    severity: tuple[float, float] = (0.3, 1.0)
    onset_s: tuple[float, float] = (30.0, 120.0)
    test_share: float = 0.3
    validation_share: float = 0.15

    def __post_init__(self) -> None:
        """Check every field."""
        checked_number("duration_s", self.duration_s, *PLAN_RANGES["duration_s"])
        checked_number("runs_per_class", self.runs_per_class, 4, 100_000)
        checked_number(
            "first_seed", self.first_seed, 0, 2**31 - 1 - len(class_ids()) * self.runs_per_class
        )
        for name, low, high in (("severity", 0.0, 1.0), ("onset_s", 0.0, self.duration_s)):
            bounds = getattr(self, name)
            if len(bounds) != 2 or not low <= bounds[0] <= bounds[1] <= high:
                raise InputError(name, f"must be [low, high] within {low:g} to {high:g}")
            object.__setattr__(self, name, (float(bounds[0]), float(bounds[1])))
        if self.conditions not in ("lab", "field"):
            raise InputError("conditions", f"must be lab or field, got {self.conditions!r}")
        for name in ("test_share", "validation_share"):
            checked_number(name, getattr(self, name), 0.05, 0.9)

    @classmethod
    def load(cls, path: Path = SPEC_PATH) -> Self:
        """Read a specification; raises `InputError` for unreadable TOML or unknown fields."""
        values = read_toml(path, "dataset")
        for name in values:
            if name not in {field.name for field in fields(cls)}:
                raise InputError(name, f"{path} has no such field")
        return cls(**values)

    def to_dict(self) -> dict[str, Any]:
        """Plain JSON-ready values."""
        return asdict(self) | {"severity": list(self.severity), "onset_s": list(self.onset_s)}


@dataclass(frozen=True, slots=True)
class PlannedRun:
    """One flight of the data set, before it is flown.

    ``fault.onset_s`` of a nominal run only says where its kept stretch lies: nothing happens there.
    """

    id: str
    split: Split
    plan: Plan
    fault: Fault


def planned_runs(spec: DatasetSpec) -> tuple[PlannedRun, ...]:
    """Every run of the data set, class by class in turn, so that any beginning is balanced."""
    modes = tuple(catalogue().values())
    splits = [_splits(spec, number) for number in range(len(modes))]
    return tuple(
        _planned_run(spec, mode, repeat, spec.first_seed + repeat * len(modes) + number,
                     splits[number][repeat])
        for repeat in range(spec.runs_per_class)
        for number, mode in enumerate(modes)
    )  # fmt: skip


def _splits(spec: DatasetSpec, class_number: int) -> list[Split]:
    """Each run's part, drawn by class: test first, then validation from the training rest."""
    n_test = round(spec.runs_per_class * spec.test_share)
    n_validation = max(1, round((spec.runs_per_class - n_test) * spec.validation_share))
    order = np.random.default_rng([spec.first_seed, class_number, 0x5917]).permutation(
        spec.runs_per_class
    )
    splits: list[Split] = ["train"] * spec.runs_per_class
    for rank, run in enumerate(order[: n_test + n_validation]):
        splits[run] = "test" if rank < n_test else "validation"
    return splits


def _planned_run(spec: DatasetSpec, mode: Mode, repeat: int, seed: int, split: Split) -> PlannedRun:
    rng = np.random.default_rng([seed, 0xFA17])
    plan = replace(Plan.sampled(seed, duration_s=spec.duration_s), conditions=spec.conditions)
    fault = Fault(
        mode=mode.id,
        severity=round(float(rng.uniform(*spec.severity)), 4),
        onset_s=round(float(rng.uniform(*spec.onset_s)), 2),
        cylinder=None if mode.whole_engine else int(rng.choice(N_CYLINDERS, p=mode.prior)) + 1,
    )
    return PlannedRun(f"{mode.id}-{repeat:04d}", split, plan, fault)


@dataclass(frozen=True, slots=True, eq=False)
class FlownRun:
    """The kept stretch of a flown run: (2, rows, 23) float32, faulted then mirror.

    ``start_row`` is its first sample in the flight, ``departure_row`` the first sample of the
    flight that shows the fault, None if none does.
    """

    start_row: int
    departure_row: int | None
    channels: Array32


def fly_run(run: PlannedRun) -> FlownRun:
    """Fly a run and its mirror and keep what a diagnosis reads of them.

    A plain function of its argument: any process, Dask worker or machine gives the same bytes.
    """
    pair = fly_pair(run.plan, run.fault)
    departure_row = _departure_row(run, pair)
    rows = _kept_rows(run, departure_row, len(pair.faulted))
    kept = pair[rows]
    channels = np.stack([kept.faulted.channels, kept.mirror.channels])
    return FlownRun(rows.start, departure_row, channels)


def _departure_row(run: PlannedRun, pair: Pair) -> int | None:
    """Where the fault begins to show: where the flight leaves the one that it would have been.

    In lab that is the mirror. In field the mirror differs from the first sample on, so the very
    same aircraft flies once more without the fault, at first only until shortly after the onset.
    """
    if run.plan.conditions == "lab":
        return first_departure(pair.residual)
    departure_row = None
    for duration_s in (run.fault.onset_s + SOON_S, run.plan.duration_s):
        healthy = fly(replace(run.plan, duration_s=min(duration_s, run.plan.duration_s)))
        n = min(len(pair.faulted), len(healthy))  # the ground may end either
        departure_row = first_departure(pair.faulted.channels[:n] - healthy.channels[:n])
        if departure_row is not None:
            break
    return departure_row


def _kept_rows(run: PlannedRun, departure_row: int | None, n_rows: int) -> slice:
    """From 30 s before the onset to 120 s after the fault shows, widened to the 5 s grid.

    ``n_rows`` is the length of the flight, which the ground may have ended before its plan did.

    Being on the grid, the stretch holds the very windows that a diagnosis of the whole flight
    reads; a defect that takes its time (a rivet's first release, say) is followed to its end.
    """
    onset_row = round(run.fault.onset_s / DT_S)
    shown_row = onset_row if departure_row is None else departure_row
    start = max(0, (onset_row - WINDOW_STEPS) // STRIDE_STEPS * STRIDE_STEPS)
    stop = -(-(shown_row + EFFECTIVE_STEPS) // STRIDE_STEPS) * STRIDE_STEPS
    return slice(start, min(stop, n_rows))


def generate(
    spec: DatasetSpec,
    out_dir: Path,
    *,
    workers: int = 2,
    scheduler: RemoteScheduler | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Manifest:
    """Fly what is missing of the data set into ``out_dir``.

    Called again after a kill it keeps every run that is whole and flies the rest; a run whose
    file no longer matches its checksum is flown again. The flying goes to ``workers`` local
    processes or to the Dask cluster at ``scheduler``; files are written here alone.
    ``progress(done, total)`` is called at the start and after each run. Raises `InputError` if
    ``out_dir`` holds another data set, `WorkerError` if the cluster cannot be reached or a run
    killed its workers, `StoreError` if the disk refuses.
    """
    runs = planned_runs(spec)
    archive = Archive.open(out_dir, spec.to_dict())
    missing = [run for run in runs if not archive.holds(run.id)]
    done = len(runs) - len(missing)
    report = progress or (lambda done, total: None)
    report(done, len(runs))
    if missing:
        with _cluster(workers, scheduler) as client:
            for run, flown in _flown(client, missing):
                archive.add(_stored(run, flown), flown.channels)
                done += 1
                report(done, len(runs))
    return archive.complete([run.id for run in runs])


def _stored(run: PlannedRun, flown: FlownRun) -> StoredRun:
    return StoredRun(
        id=run.id,
        mode=run.fault.mode,
        split=run.split,
        start_row=flown.start_row,
        departure_row=flown.departure_row,
        plan=run.plan.to_dict(),
        fault=run.fault.to_dict(),
    )


def _flown(client: Client, runs: list[PlannedRun]) -> Iterator[tuple[PlannedRun, FlownRun]]:
    """Runs as they land, never more than a few ahead, so that memory stays flat."""

    def submitted(run: PlannedRun) -> Future[FlownRun]:
        future = client.submit(fly_run, run, pure=False)
        running[future] = run
        return future

    waiting = iter(runs)
    running: dict[Future[FlownRun], PlannedRun] = {}
    ahead = IN_FLIGHT_PER_WORKER * max(1, sum(client.nthreads().values()))
    first = [submitted(run) for run in islice(waiting, ahead)]
    landing = as_completed(first, loop=client.loop, with_results=True)
    try:
        for future, flown in landing:
            yield running.pop(future), flown
            for run in islice(waiting, 1):
                landing.add(submitted(run))
    except KilledWorker as error:
        raise WorkerError(f"a run killed every worker that flew it: {error}") from None


@contextmanager
def _cluster(workers: int, scheduler: RemoteScheduler | None) -> Iterator[Client]:
    """A client of the cluster at ``scheduler``, or of a local one that lives as long as this."""
    with ExitStack() as stack:
        if scheduler is None:
            yield stack.enter_context(pool_client(workers))
            return
        client = stack.enter_context(remote_client(scheduler))
        await_workers(client, 1, f"of the scheduler {scheduler.address}")
        yield client
