"""A submitted run: its record, its events, and the pending orders of a live flight."""

import logging
from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from typing import Any

from distributed import Client, Future

from core.errors import StoreError
from core.jobs.events import Acted, Cancelled, Event, Failed, Paced, Samples
from core.jobs.feed import Feed
from core.jobs.live import Control, Orders, checked_pace, deliver
from core.jobs.worker import RunResult
from core.store.records import RunRecord
from core.store.store import RunStore
from core.twin.actions import Action

logger = logging.getLogger(__name__)

Outcome = RunResult | Failed | Cancelled


@dataclass(eq=False)
class Submitted:
    """A run and its events; not thread-safe but for ``feed``.

    ``start`` names the attempt whose events count. ``control``: of a live flight, else None.
    """

    record: RunRecord
    key: str
    client: Client
    store: RunStore
    control: Control | None = None
    feed: Feed = field(default_factory=Feed)
    future: Future[Outcome] | None = None
    start: str = ""
    is_cancelled: bool = False
    attempts_exhausted: bool = False
    is_unmanned: bool = False
    """Whether its page says that there is no worker."""
    is_given_up: bool = False

    @property
    def is_live(self) -> bool:
        """Whether it is a live flight that has not ended."""
        return self.control is not None and self.feed.final is None

    def change(self, **changes: Any) -> None:
        """Change its record."""
        self.record = replace(self.record, **changes)
        try:
            self.store.update(self.record.id, **changes)
        except StoreError as error:  # the run goes on; what it comes to may still find room
            logger.error("run %s: %s", self.record.id, error)

    # -- a live flight ---------------------------------------------------------------------------

    def act(self, action: Action) -> None:
        """Store an action, then tell page and worker; raises `InputError` or `StoreError`."""
        assert self.control is not None
        actions = self.control.with_action(action)
        self.store.save_actions(self.record.id, actions)
        self.control.actions = actions
        self._announce(actions)
        self._send(self.control)

    def steer(self, pace: float | None, is_paused: bool | None) -> None:
        """Change pace or pause, and tell page and worker; raises `InputError`."""
        assert self.control is not None
        if pace is not None:
            self.control.pace = checked_pace(pace)
        if is_paused is not None:
            self.control.is_paused = is_paused
        self.feed.append(Paced(self.record.id, self.control.pace, self.control.is_paused))
        self._send(self.control)

    def assign_worker(self, address: str, start: str) -> None:
        """Note the worker that flies it; send it, and the page, the orders of a live flight."""
        self.start = start
        control = self.control
        if control is None:
            return
        control.assign(address, start)
        self.feed.append(Paced(self.record.id, control.pace, control.is_paused))
        if control.actions:
            self.keep(control.actions)
        self._send(control)

    def note_event(self, event: Event) -> Event:
        """Note an event of the worker's; returns the event for the page."""
        control = self.control
        if control is not None and isinstance(event, Samples):
            control.note_samples(event)
        if control is not None and isinstance(event, Acted):
            if control.note_actions(event):
                self._store(control.actions)
            self.record = replace(self.record, actions=control.actions)
            return Acted(event.run_id, control.actions)
        return event

    def keep(self, actions: tuple[Action, ...]) -> None:
        """Store the actions as they are flown, and send them to the page."""
        self._store(actions)
        self._announce(actions)

    def _announce(self, actions: tuple[Action, ...]) -> None:
        self.record = replace(self.record, actions=actions)
        self.feed.append(Acted(self.record.id, actions))

    def _store(self, actions: Iterable[Action]) -> None:
        try:
            self.store.save_actions(self.record.id, actions)
        except StoreError as error:  # as in `change`
            logger.error("run %s: %s", self.record.id, error)

    def _send(self, control: Control) -> None:
        """Send all orders to the worker that flies; one that begins later asks for them."""
        loop = self.client.loop
        if control.start and loop is not None:
            order = (self.client, control.address, control.start, control.orders())
            loop.add_callback(_deliver, *order)


async def _deliver(client: Client, address: str, start: str, orders: Orders) -> None:
    """Hand orders to the worker at ``address``; on Dask's event loop."""
    try:
        await client.run(deliver, start, orders, workers=[address])
    except Exception as error:  # it died, or we did; the next worker asks for orders
        logger.debug("orders for %s did not arrive: %s", address, error)
