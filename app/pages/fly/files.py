"""Finer samples of a part of a flight, for charts that are zoomed into it.

    GET  /runs/<id>/detail?from_s=600&to_s=660

The answer is JSON: ``whole``, as a message for the tiles has it (`app.figures.sensors.decimated`),
with at most as many samples as the whole flight is drawn by; ``until_s``, up to when there are any;
``is_exact``, true where none was left out. Of a flight in progress it is what has been streamed.
"""

import asyncio
import json
from collections.abc import Iterable
from typing import Any

import numpy as np
from fastapi import FastAPI, Request, Response
from fastapi.responses import PlainTextResponse

from app.figures.axes import Array
from app.figures.sensors import TILE_POINTS, decimated, packed_lines
from core.channels import N_CHANNELS
from core.errors import InputError, MirrorTwinError
from core.jobs.engine import Engine
from core.jobs.events import Event, Samples
from core.store.store import RunStore
from core.twin.plan import PLAN_RANGES

_AT_ONCE = 2
_CLIENT_GONE = 499


def mount(app: FastAPI, engine: Engine, store: RunStore) -> None:
    """Add the route. Call it before any catch-all route."""
    free = asyncio.Semaphore(_AT_ONCE)

    @app.get("/runs/{run_id}/detail", include_in_schema=False)
    async def detail(request: Request, run_id: str, from_s: float, to_s: float) -> Response:
        async with free:
            # A page that zooms on sends another request and hangs up: skip what it no longer needs.
            if await request.is_disconnected():
                return Response(status_code=_CLIENT_GONE)
            try:
                part = await asyncio.to_thread(part_of, engine, store, run_id, from_s, to_s)
            except MirrorTwinError as error:
                return PlainTextResponse(str(error), 422 if isinstance(error, InputError) else 404)
        return Response(json.dumps(part), media_type="application/json")


def part_of(
    engine: Engine, store: RunStore, run_id: str, from_s: float, to_s: float
) -> dict[str, Any]:
    """The samples of a run between two times; raises `InputError` or `StoreError`."""
    longest_s = PLAN_RANGES["duration_s"][1]
    if not 0.0 <= from_s < to_s <= longest_s:
        raise InputError("from_s", f"must lie below to_s, both in 0 to {longest_s:g} s")
    if store.get(run_id).status == "done":
        time_s, faulted, mirror = store.load_channels(run_id, from_s, to_s)
        return {
            "whole": decimated(time_s, faulted, mirror),
            "until_s": _end(time_s, from_s),
            "is_exact": len(time_s) <= TILE_POINTS,
        }
    return streamed_part(engine.history(run_id), from_s, to_s)


def streamed_part(events: Iterable[Event], from_s: float, to_s: float) -> dict[str, Any]:
    """The streamed samples between two times: 5 Hz, and the extremes of every second."""
    parts = [
        event
        for event in events
        if isinstance(event, Samples)
        and event.time_s[-1] >= from_s - 1.0  # the second before may end with it
        and event.time_s[0] <= to_s + 1.0
    ]
    if not parts:
        return {"whole": [["", "", ""]] * N_CHANNELS, "until_s": from_s, "is_exact": False}
    sampled = np.concatenate([[part.faulted.T, part.mirror.T] for part in parts], axis=-1)
    sampled_s = np.concatenate([part.time_s for part in parts])
    extremes = np.concatenate([part.extremes for part in parts], axis=2)
    whole = []
    for index in range(N_CHANNELS):
        own = extremes[:, index].reshape(3, -1)
        both = np.concatenate([np.stack([sampled_s, *sampled[:, index]]), own], axis=1)
        both = both[:, np.unique(both[0], return_index=True)[1]]
        time_s, faulted, mirror = both[:, (both[0] >= from_s) & (both[0] <= to_s)]
        whole.append(packed_lines(time_s, faulted, mirror))
    return {"whole": whole, "until_s": _end(sampled_s, from_s), "is_exact": False}


def _end(time_s: Array, from_s: float) -> float:
    return float(time_s[-1]) if len(time_s) else from_s
