"""The stream of a run to its page, from its first event to the whole stored flight."""

import asyncio
import math
from dataclasses import dataclass

from app.kit.frames import FRAME_S, frames, joined
from app.kit.wiring import Update
from app.pages.fly.states import idle, reported, watched
from app.pages.fly.view import RunView
from app.report_desk import ReportDesk
from app.sessions import HEARTBEAT_S, BrowserPage, OpenScene
from core.jobs import events
from core.jobs.engine import Engine
from core.report.grounded import GroundedReport
from core.store.store import RunStore

PATIENCE_S = 0.3
"""How long a page that turns to a run waits for its first samples, to show them before all else."""


@dataclass(frozen=True, slots=True)
class RunStream:
    """The `app.sessions.Stream` of the page *Fly*."""

    engine: Engine
    store: RunStore
    desk: ReportDesk

    def idle(self) -> list[Update]:
        """The page without a run."""
        return idle()

    async def run(
        self, page: BrowserPage, scene: OpenScene, run_id: str, *, fill_form: bool
    ) -> None:
        """Show a run from its first event to its end, and then reports as they are written."""
        record = await asyncio.to_thread(self.store.get, run_id)
        view = RunView(record)
        subscription = self.engine.subscribe(run_id)
        await page.post(view.opening(fill_form=fill_form))
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
                    scene().reset(view.duration_s, view.onset_s)
                    await page.post(view.resting())
                if samples:
                    await asyncio.to_thread(scene().extend, samples)
                else:
                    await page.post(updates)
        finally:
            subscription.close()
        if events.Finished in seen:
            shown = seen.get(events.Reported)
            report = await self._show_whole(
                page, scene, view, shown.report if isinstance(shown, events.Reported) else None
            )
            await self._show_writing(page, run_id, report)

    async def _show_whole(
        self, page: BrowserPage, scene: OpenScene, view: RunView, shown: GroundedReport | None
    ) -> GroundedReport:
        """The finished run at full rate, from the store; returns the report that stands.

        ``shown``: the report that the page shows, None if it was not there to see the run end.
        """
        run_id = view.record.id
        diagnosis, report = await asyncio.to_thread(self.store.load_result, run_id)
        if shown is None:
            await page.send(view.diagnosed(diagnosis))
        if report != shown:
            await page.send(reported(run_id, report))
        # First what is looked at first: of two hours the channels are a third of what is stored.
        channels = await asyncio.to_thread(self.store.load_channels, run_id, 0.0, math.inf)
        await page.send(await asyncio.to_thread(view.tiles, *channels))
        await page.send(await asyncio.to_thread(view.strip, *channels))
        del channels
        pair = await asyncio.to_thread(self.store.load_pair, run_id)
        await page.send(await asyncio.to_thread(view.happened, pair))
        await asyncio.to_thread(scene().show, pair, view.onset_s)
        return report

    async def _show_writing(self, page: BrowserPage, run_id: str, stored: GroundedReport) -> None:
        """Reports as they are rewritten, and answers, for as long as the run is shown."""
        async for job in self.desk.watch(run_id, HEARTBEAT_S):
            if job is None:
                await page.send(())
                continue
            await page.send(await asyncio.to_thread(watched, job, stored))
            if job.over and job.question is None:
                stored = job.outcome or stored
