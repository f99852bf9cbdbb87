"""Sessions: which page load shows which run, and the socket that serves it.

A page load is a session, named by an unguessable id. While the page is open, one Dash WebSocket
callback (`Session.attend`) serves it: it follows the run that the page's address names, and starts
over whenever that changes. A session only ever sends what its own run emits, to its own socket.
A `Stream`, which the page *Fly* provides, decides what of a run is sent.
"""

import asyncio
import logging
import re
import secrets
from collections.abc import Callable, Iterable
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Any, Protocol

from dash.backends.ws import DashWebsocketCallback
from dash.exceptions import WebsocketDisconnected

from app.kit.wiring import Update, alert
from app.scenes.viser_proxy import ViserScenes
from app.scenes.viser_scene import ViserScene
from core.errors import InputError, MirrorTwinError

logger = logging.getLogger(__name__)

UNEXPECTED_ERROR = (
    "The server met an error it did not expect; its log says more. Reload to try again."
)

APART_S = 0.02
"""Between two messages that are to arrive apart: Dash gathers what it is given within 5 ms."""

ACK_TIMEOUT_S = 20.0
"""A page that has not acknowledged a frame for so long counts as gone."""

HEARTBEAT_S = 60.0
"""Interval between two checks that a quiet page is still there."""

LINGER_S = 60.0
"""How long a session outlives its socket: a page may come back from a lost connection."""

_SESSION = re.compile(r"[A-Za-z0-9_-]{22}")


OpenScene = Callable[[], ViserScene]
"""Opens the 3D scene of a page on first use: later than what the page shows first."""


class PageGoneError(Exception):
    """The browser page is closed, or does not answer any more."""


def new_session_id() -> str:
    """A name for one page load, which nobody else can guess."""
    return secrets.token_urlsafe(16)


class Stream(Protocol):
    """What a session sends to its page."""

    async def run(
        self, page: "BrowserPage", scene: OpenScene, run_id: str, *, fill_form: bool
    ) -> None:
        """Show a run from its first event on, for as long as there may be news of it.

        ``fill_form``: show its settings in the form, too. Raises `MirrorTwinError` and
        `PageGoneError`.
        """

    def idle(self) -> list[Update]:
        """The page without a run."""


@dataclass(frozen=True, slots=True)
class BrowserPage:
    """The adapter to one browser page, over the socket of one Dash callback."""

    socket: DashWebsocketCallback

    async def post(self, updates: Iterable[Update]) -> None:
        """Set properties without waiting; of several values for one property the last is sent.

        Figures follow one by one: the page would draw figures that arrive together in one go, and
        not respond until it has.
        """
        latest = {(item.component_id, item.prop): item for item in updates}
        together = [item for item in latest.values() if item.prop != "figure"]
        apart = [item for item in latest.values() if item.prop == "figure"]
        for place, group in enumerate([together, *([item] for item in apart)]):
            if place > 0:
                await asyncio.sleep(APART_S)
            # Turning figures into JSON takes milliseconds each: not on the event loop.
            await asyncio.to_thread(self._queue, group)

    async def send(self, updates: Iterable[Update]) -> Any:
        """Set properties, and return what the tiles hold once the page has answered.

        The round trip is what holds a fast run back to the pace of a slow page: Dash itself queues
        without a bound. Raises `PageGoneError`.
        """
        await self.post(updates)
        try:
            return await self.socket.get_prop("taken", "data", timeout=ACK_TIMEOUT_S)
        except (TimeoutError, WebsocketDisconnected):
            raise PageGoneError from None

    def _queue(self, updates: Iterable[Update]) -> None:
        for component_id, prop, value in updates:
            self.socket.set_prop_sync(component_id, prop, value)


@dataclass(slots=True)
class Session:
    """One page load: the run it shows, its 3D scene, the callback that serves it."""

    id: str
    scenes: ViserScenes
    stream: Stream
    run_id: str | None = None
    dark: bool = False
    _is_clear: bool = True
    _fill_form: bool = True
    _turned: asyncio.Event = field(default_factory=asyncio.Event)
    _attendant: asyncio.Task[None] | None = None

    def show(
        self, run_id: str | None, *, again: bool = False, form_is_current: bool = False
    ) -> None:
        """Turn the page to a run, from its first event; None empties the page.

        A run that is already shown goes on undisturbed, unless it is to be shown ``again``. The
        form is filled with the run's settings, unless it is known to hold them.
        """
        if again or run_id != self.run_id:
            self.run_id = run_id
            self._fill_form = not form_is_current
            self._turned.set()

    def clear(self) -> None:
        """Note that the page is laid out again: nothing stands on it, and nothing is shown."""
        self._is_clear = True
        self.show(None, again=True)

    @property
    def abandoned(self) -> bool:
        """Whether the page was served once and is no longer."""
        return self._attendant is not None and self._attendant.done()

    @property
    def is_unattended(self) -> bool:
        """Whether the page has not been served yet: it is about to be, or was closed before."""
        return self._attendant is None

    def scene(self) -> ViserScene:
        """The session's own viser scene, opened on first use."""
        scene = self.scenes.open(self.id)
        scene.dark = self.dark
        return scene

    def seek(self, time_s: float | None) -> None:
        """Put both aircraft of the 3D scene where they were then; None: where they are now."""
        scene = self.scenes.find(self.id)
        if scene is not None:
            scene.seek(time_s)

    async def attend(self, page: BrowserPage) -> None:
        """Serve the page until it is gone, taking over from an earlier socket of this session."""
        if self._attendant is not None:
            self._attendant.cancel()
        self._attendant = asyncio.current_task()
        with suppress(PageGoneError):
            while True:
                self._turned.clear()
                stream = asyncio.create_task(self._stream(page, self.run_id))
                try:
                    await self._until_turned(page, stream)
                finally:
                    stream.cancel()
                    await asyncio.gather(stream, return_exceptions=True)

    async def _until_turned(self, page: BrowserPage, stream: asyncio.Task[None]) -> None:
        """Wait until another run is to be shown; raise `PageGoneError` once the page is gone."""
        turned = asyncio.create_task(self._turned.wait())
        try:
            await asyncio.wait({turned, stream}, return_when=asyncio.FIRST_COMPLETED)
            if not turned.done():
                await stream  # raises what it raised
            while not turned.done():
                await asyncio.wait({turned}, timeout=HEARTBEAT_S)
                if not turned.done():
                    await page.send(())
        finally:
            turned.cancel()

    async def _stream(self, page: BrowserPage, run_id: str | None) -> None:
        """Show one run from where it stands to its end; errors become an alert on the page."""
        try:
            if run_id is not None:
                self._is_clear = False
                await self.stream.run(page, self.scene, run_id, fill_form=self._fill_form)
            elif not self._is_clear:
                self._is_clear = True
                self.scene().reset()
                await page.send(self.stream.idle())
        except MirrorTwinError as error:
            await page.send([alert("error", "This run cannot be shown", str(error))])
        except PageGoneError:
            raise
        except Exception:
            logger.exception("showing run %s failed", run_id)
            await page.send([alert("error", "Something went wrong", UNEXPECTED_ERROR)])


class Sessions:
    """The sessions of all page loads of this server."""

    def __init__(self, scenes: ViserScenes, stream: Stream) -> None:
        """Start with none; each opens its scene in ``scenes`` and sends what ``stream`` gives."""
        self._scenes, self._stream = scenes, stream
        self._sessions: dict[str, Session] = {}

    def get(self, session_id: str) -> Session:
        """The session of an id, created if need be; raises `InputError` for no possible id.

        An id that this process did not issue is accepted: its page has outlived a server restart.
        Call it on the event loop: a session that no page attends is closed after `LINGER_S`.
        """
        if not isinstance(session_id, str) or not _SESSION.fullmatch(session_id):
            raise InputError("session", "is not a session id of this server")
        if session_id not in self._sessions:
            session = Session(session_id, self._scenes, self._stream)
            self._sessions[session_id] = session
            asyncio.get_running_loop().call_later(LINGER_S, self._release, session)
        return self._sessions[session_id]

    async def attend(self, session_id: str, run_id: str | None, page: BrowserPage) -> None:
        """Serve a page until it is gone, then release its resources."""
        session = self.get(session_id)
        if run_id is not None:
            session.run_id = run_id
        try:
            await session.attend(page)
        finally:
            asyncio.get_running_loop().call_later(LINGER_S, self._release, session)

    def _release(self, session: Session) -> None:
        is_wanted = not (session.abandoned or session.is_unattended)
        if not is_wanted and self._sessions.get(session.id) is session:
            del self._sessions[session.id]
            self._scenes.close(session.id)
