"""The stream from a run's events to its page: batches, isolation, pages that go away."""

import asyncio
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from app.figures.axes import base64_floats
from app.kit.wiring import Update
from app.pages.fly import session as live
from app.pages.fly.session import PageGoneError, Session, Sessions, frames, new_session_id
from app.report_desk import ReportDesk
from app.scenes.viser_proxy import ViserScenes
from core.channels import N_CHANNELS
from core.errors import InputError, StoreError
from core.fmea.fault import Fault
from core.jobs import events
from core.jobs.feed import Feed, Subscription
from core.store.store import RunStore
from core.twin.plan import Plan
from core.twin.trajectory import STATE_NAMES


def samples(start: int, value: float) -> events.Samples:
    channels = np.full((25, N_CHANNELS), value, dtype=np.float32)
    states = np.zeros((25, len(STATE_NAMES)), dtype=np.float32)
    time_s = ((start + np.arange(25)) / 5.0).astype(np.float32)
    return events.Samples("r", start, time_s, channels, channels, states, states)


class Feeds:
    """The part of the engine that a session needs: one feed a run."""

    def __init__(self) -> None:
        self.feeds: dict[str, Feed] = {}

    def subscribe(self, run_id: str) -> Subscription:
        return self.feeds.setdefault(run_id, Feed()).subscribe()


class Recorded:
    """A page that takes everything, keeps it, and can go away."""

    def __init__(self) -> None:
        self.updates: list[Update] = []
        self.gone = False

    async def post(self, updates: Iterable[Update]) -> None:
        self.updates.extend(updates)

    async def send(self, updates: Iterable[Update]) -> Any:
        if self.gone:
            raise PageGoneError
        self.updates.extend(updates)
        return None

    def last(self, component_id: str, prop: str) -> Any:
        values = [item.value for item in self.updates if item[:2] == (component_id, prop)]
        return values[-1] if values else ""


@pytest.fixture
def store(tmp_path: Path) -> RunStore:
    return RunStore(tmp_path)


@pytest.fixture
def scenes() -> Iterator[ViserScenes]:
    opened = ViserScenes()
    yield opened
    opened.close_all()


async def until(true: Callable[[], Any]) -> None:
    async with asyncio.timeout(10):
        while not true():
            await asyncio.sleep(0.01)


def test_the_first_event_is_not_kept_waiting() -> None:
    async def scenario() -> None:
        feed = Feed()
        feed.append(events.Started("r", 1))
        batches = frames(feed.subscribe(), period_s=3600.0)
        assert await asyncio.wait_for(anext(batches), 60.0) == [events.Started("r", 1)]

    asyncio.run(scenario())


def test_frames_lose_no_event() -> None:
    async def scenario() -> list[list[events.Event]]:
        feed = Feed()
        batches: list[list[events.Event]] = []

        async def read() -> None:
            async for batch in frames(feed.subscribe(), period_s=0.2):
                batches.append(batch)

        reader = asyncio.create_task(read())
        feed.append(events.Started("r", 1))
        await until(lambda: batches)
        for start in range(0, 1000, 25):
            feed.append(samples(start, 1.0))
            await asyncio.sleep(0.005)
        feed.append(events.Finished("r"))
        await reader
        return batches

    batches = asyncio.run(scenario())
    starts = [e.index for batch in batches for e in batch if isinstance(e, events.Samples)]
    assert starts == list(range(0, 1000, 25))
    assert len(batches) <= 5
    assert isinstance(batches[-1][-1], events.Finished)


def test_two_sessions_never_see_each_others_run(store: RunStore, scenes: ViserScenes) -> None:
    async def scenario() -> tuple[Recorded, Recorded]:
        engine = Feeds()
        runs = [store.create(Plan(seed=n), Fault("engine_failure")).id for n in (1, 2)]
        pages = Recorded(), Recorded()
        desk = ReportDesk(store)
        sessions = [Session(new_session_id(), engine, store, scenes, desk) for _ in runs]
        tasks = [
            asyncio.create_task(session.attend(page))
            for session, page in zip(sessions, pages, strict=True)
        ]
        for session, run_id in zip(sessions, runs, strict=True):
            session.show(run_id)
        for value, run_id in enumerate(runs, start=1):
            engine.feeds.setdefault(run_id, Feed())
            engine.feeds[run_id].append(samples(0, float(value)))
        await until(lambda: all("faulted" in page.last("flight", "data") for page in pages))
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)
        return pages

    one, two = asyncio.run(scenario())
    expected = [np.full(N_CHANNELS * 25, value, dtype=np.float32) for value in (1.0, 2.0)]
    for page, values in zip((one, two), expected, strict=True):
        sent = [u.value for u in page.updates if u[:2] == ("flight", "data")]
        assert {m["faulted"] for m in sent if "faulted" in m} == {base64_floats(values)}
    assert one.last("run-subtitle", "children") != two.last("run-subtitle", "children")


def test_turning_to_another_run_drops_the_first(store: RunStore, scenes: ViserScenes) -> None:
    async def scenario() -> Recorded:
        engine = Feeds()
        first, second = (
            store.create(Plan(), Fault(mode)).id for mode in ("engine_failure", "baffle_crack")
        )
        session = Session(new_session_id(), engine, store, scenes, ReportDesk(store))
        page = Recorded()
        task = asyncio.create_task(session.attend(page))
        for run_id in (first, second):
            engine.feeds.setdefault(run_id, Feed()).append(events.Started(run_id, 1))
        session.show(first)
        await until(lambda: page.last("run-title", "children"))
        session.show(second)
        await until(lambda: "Baffle" in page.last("run-title", "children"))
        engine.feeds[first].append(events.Failed(first, "must not be shown", True))
        engine.feeds[second].append(samples(0, 1.0))
        await until(lambda: "faulted" in page.last("flight", "data"))
        task.cancel()
        await asyncio.gather(task, return_exceptions=True)
        return page

    page = asyncio.run(scenario())
    assert "must not be shown" not in str(page.updates)


def test_a_page_that_has_gone_ends_its_session(
    store: RunStore, scenes: ViserScenes, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(live, "LINGER_S", 0.05)
    monkeypatch.setattr(live, "HEARTBEAT_S", 0.05)

    async def scenario() -> None:
        sessions = Sessions(Feeds(), store, scenes, ReportDesk(store))
        session_id = new_session_id()
        session = sessions.get(session_id)
        session.scene()
        page = Recorded()
        task = asyncio.create_task(sessions.attend(session_id, None, page))
        await asyncio.sleep(0.1)
        assert scenes.find(session_id) is not None
        page.gone = True
        await asyncio.wait_for(task, 5)
        assert session.abandoned
        await until(lambda: scenes.find(session_id) is None)

    asyncio.run(scenario())


def test_a_page_that_nobody_came_for_keeps_no_scene(
    store: RunStore, scenes: ViserScenes, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(live, "LINGER_S", 0.1)

    async def scenario() -> None:
        sessions = Sessions(Feeds(), store, scenes, ReportDesk(store))
        closed, read = new_session_id(), new_session_id()
        for session_id in (closed, read):
            sessions.get(session_id).scene()
        task = asyncio.create_task(sessions.attend(read, None, Recorded()))
        await until(lambda: scenes.find(closed) is None)
        await asyncio.sleep(0.1)
        assert scenes.find(read) is not None
        assert sessions.get(closed).is_unattended, "and it may come back"
        task.cancel()
        await asyncio.gather(task, return_exceptions=True)

    asyncio.run(scenario())


def test_a_page_that_slept_is_served_again(store: RunStore, scenes: ViserScenes) -> None:
    async def scenario() -> Recorded:
        engine = Feeds()
        sessions = Sessions(engine, store, scenes, ReportDesk(store))
        session_id = new_session_id()
        run_id = store.create(Plan(), Fault()).id
        engine.subscribe(run_id)
        engine.feeds[run_id].append(samples(0, 1.0))
        asleep, awake = Recorded(), Recorded()
        asleep.gone = True
        await asyncio.wait_for(sessions.attend(session_id, run_id, asleep), 5)
        task = asyncio.create_task(sessions.attend(session_id, run_id, awake))
        await until(lambda: "faulted" in awake.last("flight", "data"))
        task.cancel()
        await asyncio.gather(task, return_exceptions=True)
        return awake

    assert asyncio.run(scenario()).last("run-title", "children") == "Nominal"


def test_a_run_that_cannot_be_read_becomes_an_alert(store: RunStore, scenes: ViserScenes) -> None:
    class Broken(Feeds):
        def subscribe(self, run_id: str) -> Subscription:
            raise StoreError("the disk is gone")

    async def scenario() -> Recorded:
        session = Session(new_session_id(), Broken(), store, scenes, ReportDesk(store))
        page = Recorded()
        task = asyncio.create_task(session.attend(page))
        session.show(store.create(Plan(), Fault()).id)
        await until(lambda: page.last("alert", "children"))
        task.cancel()
        await asyncio.gather(task, return_exceptions=True)
        return page

    assert "the disk is gone" in str(asyncio.run(scenario()).last("alert", "children"))


@pytest.mark.parametrize("session_id", ["", "x", "../../etc/passwd", "a" * 23, None])
def test_only_session_names_of_our_form_are_known(
    session_id: Any, store: RunStore, scenes: ViserScenes
) -> None:
    with pytest.raises(InputError):
        Sessions(Feeds(), store, scenes, ReportDesk(store)).get(session_id)


def test_session_names_are_not_guessable() -> None:
    assert len({new_session_id() for _ in range(100)}) == 100
    assert len(new_session_id()) == 22
