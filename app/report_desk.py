"""Jobs that rewrite reports and answer questions while pages watch; one job a run at a time.

A job runs on its own thread, never on the event loop or on a worker that flies. Every page that
shows the run watches it, also one that is reloaded meanwhile. The previous report is kept unless
the job makes a complete one.
"""

import asyncio
import logging
import threading
from collections import OrderedDict
from collections.abc import AsyncIterator, Callable, Iterator
from dataclasses import dataclass, field

from core.diagnosis.diagnosis import Diagnosis
from core.errors import InputError, MirrorTwinError
from core.report.case.case import Case, open_case
from core.report.grounded import (
    Done,
    Draft,
    GroundedReport,
    GroundedSentence,
    GroundingEvent,
    Note,
    Written,
    write_grounded,
)
from core.report.questions import ask
from core.report.write.offers import Offer, offered, open_writer
from core.report.write.prompts import checked_question
from core.store.store import RunStore

logger = logging.getLogger(__name__)

AT_ONCE = 4
"""Jobs that run at the same time; the next one waits."""

PERIOD_S = 0.15
"""Least time between two updates of a page [s]."""

REMEMBERED = 32
"""Ended jobs that are kept for pages that are opened later."""

UNEXPECTED = "Unexpected error in the writer; see the server's log."


@dataclass(slots=True)
class Job:
    """A report, or with a ``question`` an answer, while a thread writes it.

    ``draft``: the section being written and its text that is not checked yet. ``outcome``: the
    complete report; ``problem``: why there is none. ``case``: None until the job begins.
    """

    run_id: str
    offer: Offer
    question: str | None
    case: Case | None = None
    sentences: list[GroundedSentence] = field(default_factory=list)
    draft: tuple[str, str] = ("", "")
    notes: list[str] = field(default_factory=list)
    outcome: GroundedReport | None = None
    problem: str | None = None
    over: bool = False
    version: int = 0
    stopped: threading.Event = field(default_factory=threading.Event)

    def take(self, event: GroundingEvent) -> None:
        """Note the next event."""
        match event:
            case Draft(section=section, text=text):
                before = self.draft[1] if self.draft[0] == section else ""
                self.draft = (section, before + text)
            case Written(sentence=sentence):
                self.sentences.append(sentence)
                self.draft = (self.draft[0], _rest(self.draft[1], sentence))
            case Note(text=text):
                self.notes.append(text)
            case Done(report=report):
                self.outcome = report
                self.draft = ("", "")


class ReportDesk:
    """The jobs of this server, by run."""

    def __init__(self, store: RunStore) -> None:
        """Start without jobs."""
        self._store = store
        self._jobs: OrderedDict[str, Job] = OrderedDict()
        self._places = threading.Semaphore(AT_ONCE)
        self._news = asyncio.Condition()

    def begin(self, run_id: str, kind: str, question: str | None = None) -> Job:
        """Let a writer of that kind write about a run; call on the event loop.

        Raises `MirrorTwinError` if the writer is not available, the question is invalid, or a job
        of this run is not over.
        """
        offer = offered(kind)
        asked = None if question is None else checked_question(question)
        before = self._jobs.get(run_id)
        if before is not None and not before.over:
            raise InputError("report", f"{before.offer.name} is still writing about this run")
        job = Job(run_id, offer, asked)
        self._jobs[run_id] = job
        self._jobs.move_to_end(run_id)
        self._forget()
        loop = asyncio.get_running_loop()

        def notify() -> None:
            job.version += 1
            loop.call_soon_threadsafe(lambda: loop.create_task(self._notify()))

        notify()
        # A daemon: a writer that hangs does not keep the server from ending.
        threading.Thread(
            target=self._work, args=(job, notify), name=f"report {run_id}", daemon=True
        ).start()
        return job

    def stop(self, run_id: str) -> None:
        """Stop the job of a run; the previous report is kept."""
        job = self._jobs.get(run_id)
        if job is not None and not job.over:
            job.stopped.set()
            job.over = True
            job.version += 1
            asyncio.get_running_loop().create_task(self._notify())

    async def watch(self, run_id: str, patience_s: float) -> AsyncIterator[Job | None]:
        """The job of a run whenever it changes; None after ``patience_s`` without a change."""
        seen: tuple[Job | None, int] = (None, 0)
        while True:
            try:
                async with asyncio.timeout(patience_s), self._news:
                    while (now := self._state(run_id)) == seen:
                        await self._news.wait()
            except TimeoutError:
                yield None
                continue
            seen = now
            yield now[0]
            await asyncio.sleep(PERIOD_S)

    def close(self) -> None:
        """Stop all jobs, without waiting for writers that do not answer."""
        for job in self._jobs.values():
            job.stopped.set()

    def _state(self, run_id: str) -> tuple[Job | None, int]:
        job = self._jobs.get(run_id)
        return job, job.version if job is not None else 0

    async def _notify(self) -> None:
        async with self._news:
            self._news.notify_all()

    def _forget(self) -> None:
        ended = [run_id for run_id, job in self._jobs.items() if job.over]
        for run_id in ended[: max(0, len(self._jobs) - REMEMBERED)]:
            del self._jobs[run_id]

    def _work(self, job: Job, notify: Callable[[], None]) -> None:
        """On a thread: write, check and keep."""
        with self._places:
            self._write(job, notify)

    def _write(self, job: Job, notify: Callable[[], None]) -> None:
        try:
            diagnosis, _ = self._store.load_result(job.run_id)
            job.case = open_case(diagnosis)
            for event in self._events(job, diagnosis):
                if job.stopped.is_set():
                    return
                job.take(event)
                notify()
            if job.question is None and job.outcome is not None:
                self._store.save_report(job.run_id, job.outcome)
        except MirrorTwinError as error:
            job.problem = str(error)
        except Exception:
            logger.exception("writing about run %s failed", job.run_id)
            job.problem = UNEXPECTED
        finally:
            if not job.stopped.is_set():
                job.over = True
                notify()

    def _events(self, job: Job, diagnosis: Diagnosis) -> Iterator[GroundingEvent]:
        assert job.case is not None
        with open_writer(job.offer.kind) as writer:
            if job.question is not None:
                yield from ask(diagnosis, job.question, writer)
            else:
                yield from write_grounded(job.case, writer)


def _rest(text: str, sentence: GroundedSentence) -> str:
    """What of a draft comes after a sentence that has been checked."""
    before, found, after = text.partition(sentence.checked.text)
    return after if found else before
