"""Kills at random moments of `mirrortwin serve` and its workers: nothing lost, nothing silent.

    KILLS=50 SEED=1 python -m pytest -s tests/jobs/test_kill_campaign.py

Pages press Run again and again while workers, also those that still load what they need, and now
and then the server itself are killed; it is started again on the same store. Prints the tally.
"""

import asyncio
import os
import random
import time
from collections import Counter
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import httpx
import psutil
import pytest
from jobs_support import PATIENCE_S
from websockets.exceptions import WebSocketException

from app.crowd.page import CrowdPage
from core.errors import WorkerError
from core.fmea.catalogue import catalogue
from core.fmea.fault import Fault
from core.store.store import RunStore
from core.twin.flight import fly_pair
from core.twin.plan import Plan

KILLS = int(os.environ.get("KILLS", "6"))
SEED = int(os.environ.get("SEED", "0"))
PAGES = 3
LONGEST_LULL_S = 12.0
"""Between two kills: workers take seconds to start, so that many are killed as they do."""
SERVER_SHARE = 0.3
WARM_S = 5.0
"""A worker younger than this surely still loads what it needs."""

pytestmark = [
    pytest.mark.slow,
    pytest.mark.alone,
    pytest.mark.timeout(max(600, 60 * KILLS)),
]


@dataclass
class Campaign:
    """What has been done so far, and what came of it."""

    chance: random.Random
    kills: Counter[str] = field(default_factory=Counter)
    said: dict[str, str] = field(default_factory=dict)
    """What a page was told of how its run ended, by id."""
    silent: list[str] = field(default_factory=list)
    """Runs of a living server whose end nobody was told of."""

    def plan(self) -> tuple[Plan, Fault]:
        """Some flight of half a minute to ten."""
        mode = self.chance.choice(list(catalogue()))
        seed, duration_s = self.chance.randrange(10**6), self.chance.uniform(40.0, 600.0)
        return Plan(seed=seed, duration_s=round(duration_s)), Fault(mode, 0.7, onset_s=20.0)

    async def press_run(self, server: Any) -> None:
        """One page: run after run, for as long as the server lives."""
        while server.process.poll() is None:
            run_id = ""
            try:
                async with CrowdPage(server.url) as page:
                    run_id = await page.fly(*self.plan())
                    self.said[run_id] = await page.until_ended(PATIENCE_S)
            except TimeoutError:
                if run_id and server.process.poll() is None:
                    self.silent.append(run_id)
            except (WorkerError, OSError, WebSocketException, httpx.HTTPError):
                await asyncio.sleep(0.2)  # the server has just been killed, or still starts

    async def kill(self, server: Any, until: int) -> None:
        """Kill workers at random moments, and at last the server, or none if that is all."""
        while self.kills.total() < until:
            await asyncio.sleep(self.chance.uniform(0.0, LONGEST_LULL_S))
            if self.chance.random() < SERVER_SHARE:
                self.kills["server"] += 1
                server.process.kill()
                return
            if workers := workers_of(server):
                victim = self.chance.choice(workers)
                with suppress(psutil.NoSuchProcess):
                    is_young = time.time() - victim.create_time() < WARM_S
                    victim.kill()
                    self.kills["worker, young" if is_young else "worker"] += 1


def workers_of(server: Any) -> list[psutil.Process]:
    """The worker processes, however young."""
    with suppress(psutil.NoSuchProcess):
        children = psutil.Process(server.process.pid).children()
        return [child for child in children if "spawn_main" in " ".join(child.cmdline())]
    return []


@pytest.fixture
def campaign() -> Campaign:
    return Campaign(random.Random(SEED))


def test_nothing_is_lost_and_no_run_waits_in_silence(
    campaign: Campaign, start_server: Callable[..., Any], tmp_path: Path
) -> None:
    folder = tmp_path / "store"

    async def one_life(server: Any) -> None:
        pages = [asyncio.create_task(campaign.press_run(server)) for _ in range(PAGES)]
        await campaign.kill(server, KILLS)
        if server.process.poll() is not None:
            await asyncio.gather(*pages)
            return
        # Enough: what has been pressed must still come to an end.
        await asyncio.sleep(1.0)
        for page in pages:
            page.cancel()
        await asyncio.gather(*pages, return_exceptions=True)

    lives = 0
    while campaign.kills.total() < KILLS or lives == 0:
        server = start_server(store=folder)
        lives += 1
        asyncio.run(one_life(server))
    if server.process.poll() is not None:
        server = start_server(store=folder)  # it comes up once more, and sees what it left

    store = RunStore(folder)
    unended = ended_at_last(store)
    records = {record.id: record for record in store.records()}
    done = {run_id for run_id, said in campaign.said.items() if said == "done"}
    lost = [run_id for run_id in done if getattr(records.get(run_id), "status", "") != "done"]
    other = [record.id for record in records.values()
             if record.status == "done" and not is_whole(store, record.id)]  # fmt: skip
    unsaid = [record.id for record in records.values()
              if record.status == "failed" and not record.error]  # fmt: skip
    statuses = Counter(record.status for record in records.values())
    reasons = Counter(record.error for record in records.values() if record.error)
    print(f"\n{KILLS} kills: {dict(campaign.kills)}, {lives} lives, runs: {dict(statuses)}")
    print(f"lost {lost}, not bit for bit {other}, waiting {unended}, silent {campaign.silent}")
    print(*(f"{count} x {reason}" for reason, count in reasons.items()), sep="\n")
    assert (lost, other, unsaid, unended, campaign.silent) == ([], [], [], [], [])
    assert statuses["done"] > 0


def ended_at_last(store: RunStore) -> list[str]:
    """Runs that have not ended, though the server has had its time."""
    deadline = time.monotonic() + PATIENCE_S
    while True:
        unended = [record.id for record in store.records() if not record.finished]
        if not unended or time.monotonic() > deadline:
            return unended
        time.sleep(0.2)


def is_whole(store: RunStore, run_id: str) -> bool:
    """Whether a stored run is bit for bit what its plan and fault make of it."""
    record, pair = store.get(run_id), store.load_pair(run_id)
    again = fly_pair(record.plan, record.first_fault or Fault("nominal"))
    store.load_result(run_id)
    return (
        pair.faulted.channels.tobytes() == again.faulted.channels.tobytes()
        and pair.mirror.channels.tobytes() == again.mirror.channels.tobytes()
    )
