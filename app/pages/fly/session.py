"""From the engine to the browser: which page shows which run, and the stream that feeds it.

A page load is a session, named by an unguessable id. While the page is open, one Dash WebSocket
callback (`Session.attend`) serves it: it follows the run that the page's address names, and begins
anew whenever that changes. A session only ever sends what its own run emits, to its own socket.
"""

import asyncio
import logging
import math
import re
import secrets
from collections.abc import Iterable
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Any

from dash.backends.ws import DashWebsocketCallback
from dash.exceptions import WebsocketDisconnected

from app.kit.frames import FRAME_S, frames, joined
from app.kit.wiring import Update, alert
from app.pages.fly.view import RunView, idle, reported, watched
from app.report_desk import ReportDesk
from app.scenes.viser_proxy import ViserScenes
from app.scenes.viser_scene import ViserScene
from core.errors import InputError, MirrorTwinError
from core.jobs import events
from core.jobs.engine import Engine
from core.report.grounded import GroundedReport
from core.store.store import RunStore

logger = logging.getLogger(__name__)

UNEXPECTED = "The server met an error it did not expect; its log says more. Reload to try again."

PATIENCE_S = 0.3
"""How long a page that turns to a run waits for its first samples, to show them before all else."""

APART_S = 0.02
"""Between two messages that are to arrive apart: Dash gathers what it is given within 5 ms."""

ACK_TIMEOUT_S = 20.0
"""A page that has not taken a frame for so long is gone, or as good as gone."""

HEARTBEAT_S = 60.0
"""How often a quiet page is asked whether it is still there."""

LINGER_S = 60.0
"""How long a session outlives its socket: a page may come back from a lost connection."""

_SESSION = re.compile(r"[A-Za-z0-9_-]{22}")


class PageGoneError(Exception):
    """The browser page has been closed, or does not answer any more."""


def new_session_id() -> str:
    """A name for one page load, which nobody else can guess."""
    return secrets.token_urlsafe(16)


@dataclass(frozen=True, slots=True)
class Page:
    """The adapter to one browser page, over the socket of one Dash callback."""

    socket: DashWebsocketCallback

    async def post(self, updates: Iterable[Update]) -> None:
        """Set properties without waiting; of several values for one property the last is sent.

        Figures follow one by one: the page would draw those that come together in one go, and heed
        nobody until it has.
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
    engine: Engine
    store: RunStore
    scenes: ViserScenes
    desk: ReportDesk
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
        """Note that the page is being laid out anew: nothing stands on it, and nothing is shown."""
        self._is_clear = True
        self.show(None, again=True)

    @property
    def abandoned(self) -> bool:
        """Whether the page was served once and is not any more."""
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

    async def attend(self, page: Page) -> None:
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

    async def _until_turned(self, page: Page, stream: asyncio.Task[None]) -> None:
        """Wait for another run to be asked for; raise `PageGoneError` once the page is gone."""
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

    async def _stream(self, page: Page, run_id: str | None) -> None:
        """Show one run from where it stands to its end; errors become an alert on the page."""
        try:
            if run_id is not None:
                self._is_clear = False
                await self._show_run(page, run_id)
            elif not self._is_clear:
                self._is_clear = True
                self.scene().reset()
                await page.send(idle())
        except MirrorTwinError as error:
            await page.send([alert("error", "This run cannot be shown", str(error))])
        except PageGoneError:
            raise
        except Exception:
            logger.exception("showing run %s failed", run_id)
            await page.send([alert("error", "Something went wrong", UNEXPECTED)])

    async def _show_run(self, page: Page, run_id: str) -> None:
        record = await asyncio.to_thread(self.store.get, run_id)
        view = RunView(record)
        subscription = self.engine.subscribe(run_id)
        await page.post(view.opening(fill_form=self._fill_form))
        seen: dict[type[events.Event], events.Event] = {}
        in_place = False
        try:
            async for batch in frames(subscription, patience_s=PATIENCE_S):
                seen.update((type(event), event) for event in batch)
                updates = await asyncio.to_thread(view.changes, batch)
                if samples := joined(batch):
                    view.taken = await page.send(updates)
                if not in_place:
                    # What costs the browser most comes once the first samples are painted.
                    in_place = True
                    await asyncio.sleep(FRAME_S if samples else 0.0)
                    self.scene().reset(view.duration_s, view.onset_s)
                    await page.post(view.resting())
                if samples:
                    await asyncio.to_thread(self.scene().extend, samples)
                else:
                    await page.post(updates)
        finally:
            subscription.close()
        if events.Finished in seen:
            told = seen.get(events.Reported)
            report = await self._show_whole(
                page, view, told.report if isinstance(told, events.Reported) else None
            )
            await self._show_writing(page, run_id, report)

    async def _show_whole(
        self, page: Page, view: RunView, told: GroundedReport | None
    ) -> GroundedReport:
        """The finished run at full rate, from the store; returns the report that stands.

        ``told``: the report that the page shows, None if it was not there to see the run end.
        """
        run_id = view.record.id
        diagnosis, report = await asyncio.to_thread(self.store.load_result, run_id)
        if told is None:
            await page.send(view.diagnosed(diagnosis))
        if report != told:
            await page.send(reported(run_id, report))
        # First what is looked at first: of two hours the channels are a third of what is stored.
        channels = await asyncio.to_thread(self.store.load_channels, run_id, 0.0, math.inf)
        await page.send(await asyncio.to_thread(view.tiles, *channels))
        await page.send(await asyncio.to_thread(view.strip, *channels))
        del channels
        pair = await asyncio.to_thread(self.store.load_pair, run_id)
        await page.send(await asyncio.to_thread(view.happened, pair))
        await asyncio.to_thread(self.scene().show, pair, view.onset_s)
        return report

    async def _show_writing(self, page: Page, run_id: str, stored: GroundedReport) -> None:
        """Reports written anew and answers to questions, for as long as the run is shown."""
        async for job in self.desk.watch(run_id, HEARTBEAT_S):
            if job is None:
                await page.send(())
                continue
            await page.send(await asyncio.to_thread(watched, job, stored))
            if job.over and job.question is None:
                stored = job.outcome or stored


class Sessions:
    """The page loads that this server knows."""

    def __init__(
        self, engine: Engine, store: RunStore, scenes: ViserScenes, desk: ReportDesk
    ) -> None:
        """Start with none."""
        self._engine, self._store, self._scenes, self._desk = engine, store, scenes, desk
        self._sessions: dict[str, Session] = {}

    def get(self, session_id: str) -> Session:
        """The session of that id, made if need be; raises `InputError` for no possible id.

        An id that this process did not give is welcome: its page has outlived a server restart.
        Call it on the event loop: what no page comes for is let go after `LINGER_S`.
        """
        if not isinstance(session_id, str) or not _SESSION.fullmatch(session_id):
            raise InputError("session", "is not one that this server gives")
        if session_id not in self._sessions:
            session = self._sessions[session_id] = Session(
                session_id, self._engine, self._store, self._scenes, self._desk
            )
            asyncio.get_running_loop().call_later(LINGER_S, self._let_go, session)
        return self._sessions[session_id]

    async def attend(self, session_id: str, run_id: str | None, page: Page) -> None:
        """Serve a page until it is gone, then let go of what it held."""
        session = self.get(session_id)
        if run_id is not None:
            session.run_id = run_id
        try:
            await session.attend(page)
        finally:
            asyncio.get_running_loop().call_later(LINGER_S, self._let_go, session)

    def _let_go(self, session: Session) -> None:
        is_wanted = not (session.abandoned or session.is_unattended)
        if not is_wanted and self._sessions.get(session.id) is session:
            del self._sessions[session.id]
            self._scenes.close(session.id)
