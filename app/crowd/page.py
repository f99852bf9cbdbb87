"""A browser page as far as the server can tell: it speaks Dash's WebSocket callback protocol.

It keeps the properties that a page holds, answers what it is asked, and notes when samples come.
"""

import asyncio
import json
import re
import time
from base64 import b64decode
from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from types import TracebackType
from typing import Any, Self

import httpx
import numpy as np
from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import ConnectionClosed

from app.pages.fly.setup import field_id, form_values
from core.arrays import Array32
from core.channels import N_CHANNELS
from core.errors import WorkerError
from core.fmea.fault import Fault
from core.twin.plan import Plan

ANSWER_S = 60.0
"""How long a page waits for the answer to a click, on a machine that is busy with a crowd."""

_RUN_ID = re.compile(r"\d{8}T\d{6}-[a-z0-9]{8}")
_SESSION_ID = re.compile(r"/viser/([A-Za-z0-9_-]{22})")
_ENDED = ("done", "failed", "cancelled")

Key = tuple[str, str]
"""A property: the id of its component, and its name."""


@dataclass(slots=True)
class Arrivals:
    """What came of a run's samples: ``delays_s`` from leaving the flight to arriving here.

    ``counts`` are the samples that came with each of them. ``parts``: (start, time_s (n,), faulted
    (n, n_channels)) of each frame.
    """

    delays_s: list[float] = field(default_factory=list)
    counts: list[int] = field(default_factory=list)
    parts: list[tuple[int, Array32, Array32]] = field(default_factory=list)

    def flight(self) -> tuple[Array32, Array32]:
        """All samples as one: time (n,) and faulted channels (n, n_channels)."""
        parts = sorted(self.parts, key=lambda part: part[0])
        return (
            np.concatenate([time_s for _, time_s, _ in parts]),
            np.concatenate([faulted for _, _, faulted in parts]),
        )


class CrowdPage:
    """One page, from its loading to its closing; an asynchronous context.

    ``names`` collects every run id and scene that the server ever named to it, ``n_bytes`` what
    came over the socket.
    """

    def __init__(self, url: str) -> None:
        """A page of the server at ``url``, not loaded yet."""
        self.url = url
        self.props: dict[Key, Any] = {}
        self.names: set[str] = set()
        self.arrivals = Arrivals()
        self.n_bytes = 0
        self.whole: dict[str, Any] | None = None
        self._callbacks: dict[Key, Mapping[str, Any]] = {}
        self._answers: dict[str, asyncio.Future[Any]] = {}
        self._changed = asyncio.Event()
        self._requests = 0

    @property
    def session_id(self) -> str:
        """What the server calls this page load."""
        return str(self.props["session", "data"])

    async def __aenter__(self) -> Self:
        """Load the page, and have it served."""
        async with httpx.AsyncClient(base_url=self.url, timeout=ANSWER_S) as http:
            layout = (await http.get("/_dash-layout")).json()
            listed = (await http.get("/_dash-dependencies")).json()
        self._hold(layout)
        for callback in listed:
            if callback["clientside_function"] is None:
                for source in callback["inputs"] or [{"id": "", "property": ""}]:
                    self._callbacks.setdefault((source["id"], source["property"]), callback)
        self._socket: ClientConnection = await connect(
            self.url.replace("http", "ws") + "/_dash-ws-callback",
            origin=self.url,  # type: ignore[arg-type]  # a NewType of str
            max_size=None, ping_interval=None, compression=None, open_timeout=ANSWER_S,
        )  # fmt: skip
        self._listener = asyncio.create_task(self._listen())
        self.props["url", "pathname"] = "/"
        self.props["scheme", "data"] = "light"
        await self._turn()
        await self.start(("", ""))  # no input: it is what serves the page
        return self

    async def __aexit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Close the page."""
        await self._socket.close()
        await asyncio.gather(self._listener, return_exceptions=True)

    async def fly(self, plan: Plan, fault: Fault, **controls: Any) -> str:
        """Fill in the form and press Run; returns the run's id.

        ``controls`` are values of further controls, by component id. Raises `WorkerError` with
        what the page says if nothing flies.
        """
        if unknown := [name for name in controls if (name, "value") not in self.props]:
            raise WorkerError(f"the page has no control {', '.join(unknown)}")
        values = form_values(plan, fault)
        self.props |= {(field_id(name), "value"): value for name, value in values.items()}
        self.props |= {(name, "value"): value for name, value in controls.items()}
        self.props["run", "n_clicks"] = (self.props.get(("run", "n_clicks")) or 0) + 1
        self.arrivals, self.whole = Arrivals(), None
        self.props["fly", "data-status"] = "idle"
        await self.ask(("run", "n_clicks"))
        path = str(self.props["url", "pathname"])
        if not path.startswith("/run/"):
            raise WorkerError(f"the page does not fly: {self.props.get(('alert', 'children'))}")
        await self._turn()
        return path.removeprefix("/run/")

    async def until_ended(self, timeout_s: float) -> str:
        """Wait for the run's end, and for its whole flight if it is done; returns its status."""
        async with asyncio.timeout(timeout_s):
            while True:
                status = str(self.props.get(("fly", "data-status")))
                if status in _ENDED and (status != "done" or self.whole is not None):
                    return status
                if self._listener.done():
                    raise WorkerError("the server has closed the connection")
                self._changed.clear()
                await self._changed.wait()

    def stop_reading(self) -> None:
        """Take nothing more from the network, as a page does whose computer hangs."""
        self._socket.transport.pause_reading()

    async def ask(self, source: Key) -> None:
        """Run the callback of a property, and take what it answers."""
        answer = await asyncio.wait_for(await self.start(source), ANSWER_S)
        for component_id, props in (answer.get("data") or {}).get("response", {}).items():
            for name, value in props.items():
                self._set(component_id.split("@")[0], name.split("@")[0], value)

    async def is_served(self) -> bool:
        """Whether the server still answers to this page."""
        await self.ask(("url", "pathname"))
        return not self._listener.done()

    async def start(self, source: Key) -> asyncio.Future[Any]:
        """Call the callback of a property; the future is what it will answer."""
        callback = self._callbacks[source]
        self._requests += 1
        request = f"{id(self)}-{self._requests}"
        self._answers[request] = asyncio.get_running_loop().create_future()
        await self._send(
            {
                "type": "callback_request",
                "requestId": request,
                "payload": {
                    "output": callback["output"],
                    "outputs": _outputs(callback["output"]),
                    "inputs": self._values(callback["inputs"]),
                    "state": self._values(callback["state"]),
                    "changedPropIds": [".".join(source)] if source[0] else [],
                },
            }
        )
        return self._answers[request]

    # -- inside ----------------------------------------------------------------------------------

    async def _turn(self) -> None:
        """What the page does when its address has changed."""
        await self.ask(("url", "pathname"))
        await self.ask(("scene-tab", "value"))

    def _values(self, wanted: Iterable[Mapping[str, str]]) -> list[dict[str, Any]]:
        return [{**one, "value": self.props.get((one["id"], one["property"]))} for one in wanted]

    async def _send(self, message: dict[str, Any]) -> None:
        await self._socket.send(json.dumps({"rendererId": "page", **message}))

    async def _listen(self) -> None:
        with suppress(ConnectionClosed):
            async for text in self._socket:
                now_s = time.time()
                assert isinstance(text, str)
                self.n_bytes += len(text)
                self.names.update(_RUN_ID.findall(text), _SESSION_ID.findall(text))
                messages = json.loads(text)
                for message in messages if isinstance(messages, list) else [messages]:
                    await self._take(message, now_s)
                self._changed.set()
        self._changed.set()

    async def _take(self, message: Mapping[str, Any], now_s: float) -> None:
        payload: Any = message.get("payload")
        match message["type"]:
            case "set_props":
                for name, value in payload["props"].items():
                    self._set(payload["componentId"], name, value, now_s)
            case "get_props_request":
                held = {
                    name: self.props.get((payload["componentId"], name))
                    for name in payload["properties"]
                }
                answer = {"requestId": message["requestId"], "payload": held}
                await self._send({"type": "get_props_response", **answer})
            case "callback_response":
                self._answers.pop(message["requestId"]).set_result(payload)

    def _set(self, component_id: str, name: str, value: Any, now_s: float = 0.0) -> None:
        self.props[component_id, name] = value
        self._hold(value)
        if (component_id, name) == ("flight", "data"):
            self._taken(value, now_s)

    def _hold(self, value: Any) -> None:
        """Take over the properties of all components in a layout."""
        for component in _components(value):
            own = component["props"]
            if isinstance(own.get("id"), str):
                self.props |= {(own["id"], name): held for name, held in own.items()}

    def _taken(self, flight: Mapping[str, Any], now_s: float) -> None:
        """Do as `fly/tiles.js` does, without drawing."""
        count = 0
        if "whole" in flight:
            self.whole = dict(flight)
            count = 2**53 - 1
        elif "time_s" in flight:
            time_s = _floats(flight["time_s"])
            faulted = _floats(flight["faulted"]).reshape(N_CHANNELS, -1).T
            count = flight["start"] + len(time_s)
            self.arrivals.parts.append((flight["start"], time_s, faulted))
            self.arrivals.delays_s.append(now_s - flight["flown_at_s"])
            self.arrivals.counts.append(len(time_s))
        self.props["taken", "data"] = {"key": flight["key"], "count": count}


def _outputs(output: str) -> Any:
    """The outputs of a callback as the browser lists them; nothing for one that has none."""
    parts = output[2:-2].split("...") if output.startswith("..") else [output]
    listed = []
    for part in parts:
        component_id, dot, name = part.partition(".")
        if dot:
            listed.append({"id": component_id, "property": name})
    return listed if output.startswith("..") else (listed[0] if listed else None)


def _components(value: Any) -> Iterator[dict[str, Any]]:
    if isinstance(value, dict):
        if isinstance(value.get("props"), dict) and "type" in value:
            yield value
        for inner in value.values():
            yield from _components(inner)
    elif isinstance(value, list):
        for inner in value:
            yield from _components(inner)


def _floats(text: str) -> Array32:
    return np.frombuffer(b64decode(text), dtype=np.float32)
