"""The events of one run, kept in order, for any number of readers on threads and event loops."""

import asyncio
import threading
import time
from typing import Self
from weakref import WeakSet

from core.jobs.events import Event, FinalEvent


class Feed:
    """The events of one run.

    Thread-safe. Readers keep a place in the one shared list, so a reader that never reads costs
    nothing and holds nobody up.
    """

    def __init__(self) -> None:
        """Start empty."""
        self._changed = threading.Condition()
        self._events: list[Event] = []
        self._round = 0
        self._final: FinalEvent | None = None
        self._subscriptions: WeakSet[Subscription] = WeakSet()

    @property
    def final(self) -> FinalEvent | None:
        """The event that ended the run, None while it lives."""
        return self._final

    def append(self, event: Event) -> bool:
        """Add an event; False, and nothing is added, once the run has ended."""
        with self._changed:
            if self._final is not None:
                return False
            self._events.append(event)
            if isinstance(event, FinalEvent):
                self._final = event
            self._tell()
            return True

    def restart(self, event: Event) -> bool:
        """Void what came before and begin again with ``event``; False once the run has ended."""
        with self._changed:
            if self._final is not None:
                return False
            self._events = []
            self._round += 1
            return self.append(event)

    def events(self) -> list[Event]:
        """All events so far."""
        with self._changed:
            return list(self._events)

    def wait(self, timeout: float | None = None) -> FinalEvent | None:
        """Block until the run has ended; None if ``timeout`` seconds pass first."""
        with self._changed:
            self._changed.wait_for(lambda: self._final is not None, timeout)
            return self._final

    def subscribe(self) -> "Subscription":
        """A reader that begins with the first event."""
        subscription = Subscription(self)
        with self._changed:
            self._subscriptions.add(subscription)
        return subscription

    def _tell(self) -> None:
        self._changed.notify_all()
        for subscription in self._subscriptions:
            subscription._wake()


class Subscription:
    """Reads a feed from its first event to its last; for one reader.

    On a thread: ``get`` until ``over``. On an event loop: ``async for event in subscription``.
    """

    def __init__(self, feed: Feed) -> None:
        """Called by `Feed.subscribe`."""
        self._feed = feed
        self._round = 0
        self._place = 0
        self._closed = False
        self._waiting: tuple[asyncio.AbstractEventLoop, asyncio.Event] | None = None

    @property
    def over(self) -> bool:
        """Whether everything has been read and nothing more will come."""
        with self._feed._changed:
            return self._closed or (self._feed._final is not None and not self._has_more())

    def get(self, timeout: float | None = None) -> Event | None:
        """The next event; None if ``timeout`` seconds pass without one, or when `over`.

        ``timeout`` None waits for as long as it takes, 0 not at all.
        """
        deadline = None if timeout is None else time.monotonic() + timeout
        with self._feed._changed:
            while not self._closed:
                if self._has_more():
                    event = self._feed._events[self._place]
                    self._place += 1
                    return event
                left = None if deadline is None else deadline - time.monotonic()
                if self._feed._final is not None or (left is not None and left <= 0):
                    break
                self._feed._changed.wait(left)
        return None

    def close(self) -> None:
        """Stop reading; a waiting ``get`` or ``async for`` ends. Any thread may call this."""
        with self._feed._changed:
            self._closed = True
            self._feed._changed.notify_all()
            self._wake()

    def __aiter__(self) -> Self:
        """Iterate on the running event loop, which is never blocked."""
        return self

    async def __anext__(self) -> Event:
        """The next event, as soon as there is one."""
        wake = asyncio.Event()
        self._waiting = asyncio.get_running_loop(), wake
        try:
            while True:
                wake.clear()
                event = self.get(timeout=0)
                if event is not None:
                    return event
                if self.over:
                    raise StopAsyncIteration
                await wake.wait()
        finally:
            self._waiting = None

    def _has_more(self) -> bool:
        if self._round != self._feed._round:
            self._round, self._place = self._feed._round, 0
        return self._place < len(self._feed._events)

    def _wake(self) -> None:
        waiting = self._waiting
        if waiting is None:
            return
        loop, wake = waiting
        try:
            loop.call_soon_threadsafe(wake.set)
        except RuntimeError:  # the reader's loop has closed: nobody is left to wake
            self._waiting = None
