"""Many pages at once on one server: how late samples are, what it costs, who sees what.

The delay of a sample is counted from when its block left the flight, in the worker's process, to
when the frame that holds it has arrived in the page's, both by this machine's clock. All samples of
a frame count with the delay of the oldest of them, so that figures err on the late side. So they
hold the way through Dask, engine and server, the wait for the next frame (`FRAME_S`) and
whatever the pages themselves, all in one process here, take to hear of it.
"""

import asyncio
import tempfile
import time
from collections.abc import Callable, Sequence
from contextlib import AsyncExitStack
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
import psutil

from app.crowd.page import CrowdPage
from app.crowd.server import Served, served
from app.sessions import ACK_TIMEOUT_S
from core.errors import WorkerError
from core.fmea.catalogue import catalogue
from core.fmea.fault import Fault
from core.jobs.events import SAMPLE_STRIDE
from core.store.store import RunStore
from core.twin.plan import Plan

ENDING_S = 900.0
"""How long a crowd may take on a machine that is busy besides."""

QUIET_LOAD = 1.0
"""More processes than this that want a core, besides ours, make the delays say little."""

RUNS_A_READING = 10
"""Between two looks at the server's memory."""

Progress = Callable[[float], None]


@dataclass(frozen=True, slots=True)
class Flights:
    """What every page of a crowd flies: so long, at that pace, None for as fast as it goes."""

    duration_s: float
    pace: float | None


FULL = Flights(300.0, 10.0)
QUICK = Flights(60.0, 10.0)


@dataclass(frozen=True, slots=True)
class Delays:
    """Of all samples of all pages, in seconds."""

    samples: int
    median_s: float
    p95_s: float
    max_s: float

    @classmethod
    def of(cls, pages: Sequence[CrowdPage]) -> "Delays":
        """Those of what came to ``pages``; raises `WorkerError` if nothing did."""
        delays_s = [late for page in pages for late in page.arrivals.delays_s]
        counts = [count for page in pages for count in page.arrivals.counts]
        if not delays_s:
            raise WorkerError("no samples came to any page")
        every = np.repeat(delays_s, counts)
        median_s, p95_s = np.quantile(every, [0.5, 0.95])
        return cls(len(every), float(median_s), float(p95_s), float(every.max()))


@dataclass(frozen=True, slots=True)
class Round:
    """One crowd, from the first click to the end of the last flight.

    ``server_mb``, ``workers_mb``: resident memory with every page still open. ``cpu_share``: cores
    that the server's own process kept busy. ``strangers``: names of runs or scenes of others that
    a page was told; ``foreign_flights``: pages whose samples are not those of their run.
    """

    delays: Delays
    seconds: float
    mb_a_page: float
    cpu_share: float
    server_mb: float
    workers_mb: float
    strangers: int
    foreign_flights: int


@dataclass(frozen=True, slots=True)
class Unread:
    """A crowd one page of which reads nothing: ``others`` are the delays of the rest.

    ``gone_s``: seconds until the server had let go of it, None if it never did while we looked.
    """

    others: Delays
    gone_s: float | None


@dataclass(frozen=True, slots=True)
class Crowd:
    """What many pages at once meet. ``load`` is what the machine had to do before we came.

    ``alone_mb``: memory of the server after each tenth run of a single page.
    """

    pages: int
    flights: Flights
    before_mb: float
    rounds: tuple[Round, ...]
    unread: Unread
    alone_mb: tuple[float, ...]
    load: float

    @property
    def p95_s(self) -> float:
        """The worst of the rounds."""
        return max(each.delays.p95_s for each in self.rounds)

    @property
    def busy(self) -> bool:
        """Whether the machine had other things to do."""
        return self.load > QUIET_LOAD

    def to_dict(self) -> dict[str, Any]:
        """Plain JSON-ready values."""
        return {"p95_s": self.p95_s, "busy": self.busy, **asdict(self)}


def measure(
    pages: int,
    flights: Flights,
    rounds: int = 3,
    alone: int = 50,
    progress: Progress = lambda share: None,
) -> Crowd:
    """Start a server and measure; raises `WorkerError` where something does not fly."""
    load = psutil.getloadavg()[0]
    with (
        tempfile.TemporaryDirectory(prefix="mirrortwin-") as folder,
        served(Path(folder)) as server,
    ):

        async def everything() -> Crowd:
            await _fly_one(server, Flights(30.0, None))  # the first run of all loads much
            before_mb = server.server_mb
            done: list[Round] = []
            for _ in range(rounds):
                done.append(await crowd(server, pages, flights))
                progress(0.6 * len(done) / rounds)
            unread = await one_reads_nothing(server, pages, flights)
            progress(0.8)
            alone_mb = await one_after_another(server, alone)
            return Crowd(pages, flights, before_mb, tuple(done), unread, tuple(alone_mb), load)

        return asyncio.run(everything())


async def crowd(server: Served, count: int, flights: Flights) -> Round:
    """So many pages at once, each with a flight of its own."""
    async with AsyncExitStack() as stack:
        pages = [await stack.enter_async_context(CrowdPage(server.url)) for _ in range(count)]
        begun_s, cpu_s = time.monotonic(), _cpu_s(server)
        run_ids = await _fly_all(pages, flights)
        await _all_done(pages)
        seconds = time.monotonic() - begun_s
        cpu_share = (_cpu_s(server) - cpu_s) / seconds
        server_mb, workers_mb = server.server_mb, server.workers_mb
    store = RunStore(server.store)
    return Round(
        delays=Delays.of(pages),
        seconds=seconds,
        mb_a_page=sum(page.n_bytes for page in pages) / count / 1e6,
        cpu_share=cpu_share,
        server_mb=server_mb,
        workers_mb=workers_mb,
        strangers=sum(
            len(page.names - {run_id, page.session_id})
            for page, run_id in zip(pages, run_ids, strict=True)
        ),
        foreign_flights=sum(
            not is_own(page, store, run_id) for page, run_id in zip(pages, run_ids, strict=True)
        ),
    )


async def one_reads_nothing(server: Served, count: int, flights: Flights) -> Unread:
    """A crowd one page of which stops reading as soon as it has pressed Run."""
    async with AsyncExitStack() as stack:
        pages = [await stack.enter_async_context(CrowdPage(server.url)) for _ in range(count)]
        deaf, *others = pages
        run_id = (await _fly_all([deaf], flights))[0]
        deaf.stop_reading()
        begun_s = time.monotonic()
        await _fly_all(others, flights)
        letting_go = asyncio.create_task(_until_let_go(server, count, begun_s))
        await _all_done(others)
        others_delays = Delays.of(others)
        gone_s = await letting_go
    status = RunStore(server.store).get(run_id).status
    if status not in ("done", "running"):
        raise WorkerError(f"the run of the page that reads nothing is {status}")
    return Unread(others_delays, gone_s)


async def one_after_another(server: Served, runs: int) -> list[float]:
    """Runs on a single page: the server's memory after each tenth."""
    memory_mb = []
    async with CrowdPage(server.url) as page:
        for number in range(1, runs + 1):
            await page.fly(*_flight(number, Flights(60.0, None)))
            await page.until_ended(ENDING_S)
            if number % RUNS_A_READING == 0:
                memory_mb.append(server.server_mb)
    return memory_mb


def is_own(page: CrowdPage, store: RunStore, run_id: str) -> bool:
    """Whether what came to the page is, bit for bit, the flight that is stored under that name."""
    time_s, faulted = page.arrivals.flight()
    stored = store.load_pair(run_id).faulted
    expected = stored.channels[::SAMPLE_STRIDE].astype(np.float32)
    return len(time_s) == len(expected) and bool(np.array_equal(faulted, expected))


# -- inside --------------------------------------------------------------------------------------


def _flight(number: int, flights: Flights) -> tuple[Plan, Fault]:
    """Another flight for every number."""
    modes = [mode for mode in catalogue() if mode != "nominal"]
    plan = Plan(
        altitude_ft=3000.0 + 50.0 * (number % 60),
        seed=number,
        duration_s=flights.duration_s,
    )
    return plan, Fault(modes[number % len(modes)], severity=0.7, onset_s=flights.duration_s / 3)


async def _fly_one(server: Served, flights: Flights) -> None:
    async with CrowdPage(server.url) as page:
        await _fly_all([page], flights)
        await _all_done([page])


async def _fly_all(pages: Sequence[CrowdPage], flights: Flights) -> list[str]:
    controls: dict[str, Any] = {} if flights.pace is None else {"pace": f"{flights.pace:g}"}
    return [
        await page.fly(*_flight(number, flights), **controls)
        for number, page in enumerate(pages, start=1)
    ]


async def _all_done(pages: Sequence[CrowdPage]) -> None:
    ends = await asyncio.gather(*(page.until_ended(ENDING_S) for page in pages))
    if set(ends) != {"done"}:
        raise WorkerError(f"of {len(pages)} runs, {ends.count('done')} are done")


async def _until_let_go(server: Served, connections: int, begun_s: float) -> float | None:
    """Seconds until the server has one connection less; None if that never comes."""
    patience_s = 4.0 * ACK_TIMEOUT_S
    while time.monotonic() - begun_s < patience_s:
        if server.connections < connections:
            return time.monotonic() - begun_s
        await asyncio.sleep(0.5)
    return None


def _cpu_s(server: Served) -> float:
    used = server.process.cpu_times()
    return float(used.user + used.system)
