"""A run's events and their readers."""

import asyncio
import gc
import threading
import time
import weakref
from concurrent.futures import ThreadPoolExecutor

from jobs_support import read_all

from core.jobs.events import Cancelled, Event, Finished, Progress, Started
from core.jobs.feed import Feed, Subscription


def step(number: int) -> Progress:
    """The n-th of many events."""
    return Progress("run", "flying", number / 1000)


def filled(count: int) -> Feed:
    """A feed of that many steps."""
    feed = Feed()
    for number in range(count):
        feed.append(step(number))
    return feed


def test_a_late_reader_sees_all() -> None:
    feed = filled(5)
    feed.append(Finished("run"))
    expected = [*map(step, range(5)), Finished("run")]
    assert read_all(feed.subscribe()) == expected == feed.events()


def test_after_the_final_event_nothing_is_added() -> None:
    feed = filled(1)
    assert feed.append(Cancelled("run"))
    assert not feed.append(step(1))
    assert not feed.restart(Started("run", 2))
    assert feed.events() == [step(0), Cancelled("run")]
    assert feed.wait(0) == feed.final == Cancelled("run")


def test_get_gives_up_in_time() -> None:
    subscription = Feed().subscribe()
    began = time.monotonic()
    assert subscription.get(timeout=0.05) is None
    assert time.monotonic() - began > 0.04
    assert not subscription.over


def test_a_second_attempt_voids_the_first() -> None:
    feed = filled(3)
    halfway, behind = feed.subscribe(), feed.subscribe()
    assert [halfway.get(0) for _ in range(3)] == feed.events()
    behind.get(0)
    feed.restart(Started("run", 2))
    feed.append(Finished("run"))
    assert read_all(halfway) == read_all(behind) == [Started("run", 2), Finished("run")]


def test_eight_threads_read_the_same() -> None:
    feed = Feed()
    with ThreadPoolExecutor(8) as pool:
        readers = [pool.submit(read_all, feed.subscribe()) for _ in range(8)]
        for number in range(1000):
            feed.append(step(number))
        feed.append(Finished("run"))
        expected = feed.events()
        assert all(reader.result(30) == expected for reader in readers)


def test_event_loops_read_what_threads_write() -> None:
    feed = Feed()

    async def read(subscription: Subscription) -> list[Event]:
        return [event async for event in subscription]

    async def read_four() -> list[list[Event]]:
        return await asyncio.gather(*(read(feed.subscribe()) for _ in range(4)))

    def write() -> None:
        for number in range(300):
            feed.append(step(number))
            if number % 50 == 0:
                time.sleep(0.005)
        feed.append(Finished("run"))

    writer = threading.Timer(0.05, write)
    writer.start()
    assert asyncio.run(asyncio.wait_for(read_four(), 30)) == [feed.events()] * 4
    writer.join()


def test_waiting_readers_do_not_block_their_loop() -> None:
    async def count_while_waiting() -> int:
        waiting = asyncio.ensure_future(anext(Feed().subscribe()))
        ticks = 0
        for _ in range(20):
            await asyncio.sleep(0.001)
            ticks += 1
        assert not waiting.done()
        waiting.cancel()
        return ticks

    assert asyncio.run(asyncio.wait_for(count_while_waiting(), 5)) == 20


def test_close_ends_a_waiting_reader() -> None:
    feed = Feed()
    blocked, looping = feed.subscribe(), feed.subscribe()

    async def read() -> list[Event]:
        asyncio.get_running_loop().call_later(0.05, looping.close)
        return [event async for event in looping]

    threading.Timer(0.05, blocked.close).start()
    assert blocked.get(timeout=10) is None
    assert blocked.over
    assert asyncio.run(asyncio.wait_for(read(), 10)) == []


def test_a_reader_whose_loop_is_gone_harms_nobody() -> None:
    feed = Feed()
    subscription = feed.subscribe()

    async def abandon() -> None:
        asyncio.ensure_future(anext(subscription))  # noqa: RUF006
        await asyncio.sleep(0.01)

    loop = asyncio.new_event_loop()
    loop.run_until_complete(abandon())
    loop.close()
    assert feed.append(step(0))
    assert feed.events() == [step(0)]


def test_abandoned_readers_are_forgotten() -> None:
    feed = filled(10)
    abandoned = weakref.ref(feed.subscribe())
    gc.collect()
    assert abandoned() is None
    feed.append(Finished("run"))
