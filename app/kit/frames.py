"""Batches of a run's events, at the pace of their consumer."""

import asyncio
from collections.abc import AsyncIterator, Iterable

import numpy as np

from core.jobs.events import Event, FinalEvent, Samples
from core.jobs.feed import Subscription

FRAME_S = 0.3
"""How often a page is updated at most; what comes faster is sent together."""


async def frames(
    subscription: Subscription, period_s: float = FRAME_S, patience_s: float = 0.0
) -> AsyncIterator[list[Event]]:
    """The events of a run in batches: the first samples at once, then one batch a period at most.

    The first batch is held back for ``patience_s`` at most, so that it holds the first samples or
    the end. Whatever arrives while the consumer is busy waits for the next batch; none is dropped.
    """
    loop = asyncio.get_running_loop()
    next_frame_s = loop.time()
    batch = await _opening(subscription, patience_s)
    while True:
        if not any(isinstance(event, FinalEvent) for event in batch):
            await asyncio.sleep(next_frame_s - loop.time())
        while (more := subscription.get(timeout=0)) is not None:
            batch.append(more)
        if any(isinstance(event, Samples) for event in batch):
            next_frame_s = loop.time() + period_s
        if batch:
            yield batch
        try:
            batch = [await anext(subscription)]
        except StopAsyncIteration:
            return


def joined(batch: Iterable[Event]) -> Samples | None:
    """All samples of a batch as one event; None if it has none."""
    parts = [event for event in batch if isinstance(event, Samples)]
    if len(parts) < 2:
        return parts[0] if parts else None
    columns = ("time_s", "faulted", "mirror", "faulted_states", "mirror_states")
    whole = {name: np.concatenate([getattr(part, name) for part in parts]) for name in columns}
    extremes = np.concatenate([part.extremes for part in parts], axis=2)
    first = parts[0]
    return Samples(
        first.run_id, first.index, **whole, flown_at_s=first.flown_at_s, extremes=extremes
    )


async def _opening(subscription: Subscription, patience_s: float) -> list[Event]:
    """The events up to the first samples, the end of the run, or the timeout."""
    batch: list[Event] = []
    try:
        async with asyncio.timeout(patience_s):
            async for event in subscription:
                batch.append(event)
                if isinstance(event, Samples | FinalEvent):
                    break
    except TimeoutError:
        pass
    return batch
