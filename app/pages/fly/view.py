"""The view of one run: events in, property updates out. Nothing is sent from here."""

import secrets
import time
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from app.figures.axes import Array, Array32
from app.figures.marks import Mark, action_marks, limit_marks, track, verdict_marks
from app.figures.outcome_line import OUTCOME_ID, outcome_line
from app.figures.probabilities import class_colours, leaders, probability_figure
from app.figures.residuals import heat_strip
from app.figures.sensors import cleared, decimated
from app.figures.streamed import Streamed
from app.kit.nodes import nodes
from app.kit.wiring import Update, alert
from app.kit.words import (
    STAGES,
    STATUS_WORDS,
    cautions,
    live_caution,
    run_subtitle,
    run_title,
)
from app.pages.fly import live_controls
from app.pages.fly import page as fly
from app.pages.fly.cursor_tools import ACTION_MARKS_ID, LIMIT_MARKS_ID, TRACK_ID, VERDICT_MARKS_ID
from app.pages.fly.lists import event_list, ranking_list
from app.pages.fly.setup import error_id, field_id, form_values
from app.pages.fly.states import (
    blank,
    button_updates,
    cautioned,
    reported,
    resting_charts,
    status_updates,
)
from core.clock import clock
from core.diagnosis.diagnosis import Diagnosis
from core.fmea.catalogue import catalogue
from core.fmea.fault import Fault
from core.jobs import events
from core.store.outcome import run_outcome
from core.store.records import RunRecord, Status
from core.twin.events import flight_events
from core.twin.trajectory import Pair

STRIP_FRAMES = 20
"""Most redrawings of the heat strip during a flight: each costs 19 kB."""

LAST_SAMPLE_S = 0.5
"""A flight counts as complete when its last sample is this close to its end (0.2 s at 5 Hz)."""

JUDGED_S = 1.0
"""Minimum time between two updates of the ranking during a run: each costs 25 kB."""


class RunView:
    """What a run has shown so far; turns each batch of events into updates of the page."""

    def __init__(self, record: RunRecord) -> None:
        """Start with a run of which nothing has been shown."""
        self.record = record
        self.duration_s = record.plan.duration_s
        self.onset_s = _onset_s(record)
        self._names = {mode.id: mode.name for mode in catalogue().values()}
        self.taken: Any = None
        """The samples that the tiles hold, as last reported: ``{"key": ..., "count": ...}``."""
        self._begin()

    def _begin(self) -> None:
        """Start with empty tiles, without the samples of an earlier, failed attempt."""
        key = secrets.token_hex(8)
        self._tiles = cleared(key, self.duration_s, self.onset_s, self.record.id)
        self._is_paused = False
        self._strip_s = 0.0
        self._left: list[tuple[int, float]] = []  # of each block its first sample, and when it left
        self._stream = Streamed(self.duration_s)
        self._windows: list[events.Probabilities] = []
        self._is_judged = True
        self._judge_at_s = 0.0

    def opening(self, *, fill_form: bool) -> list[Update]:
        """The first updates for this run: its name, its state, its settings in the form."""
        values = form_values(self.record.plan, self.record.fault) if fill_form else {}
        return [
            *blank(),
            *self._named(),
            *self._state(self.record.status),
            *(Update(field_id(name), "value", value) for name, value in values.items()),
            *(Update(error_id(name), "error", None) for name in values),
        ]

    def resting(self) -> list[Update]:
        """The updates at the start of a run that its first samples need not wait for.

        Axes of this flight for each chart that has nothing to show yet, and the mirror chosen.
        """
        figures = fly.resting_figures(self.duration_s, self.onset_s)
        if self._strip_s > 0.0:
            del figures[fly.STRIP_ID]
        if self._windows:
            del figures[fly.PROBABILITIES_ID]
        updates = [Update(graph, "figure", figure) for graph, figure in figures.items()]
        updates += [
            Update(fly.RESIDUAL_SWITCH_ID, "value", "paired"),
            Update("scrub", "max", self.duration_s),
            Update("scrub", "marks", self._scrub_marks()),
        ]
        return updates if self._left else [Update("flight", "data", self._tiles), *updates]

    def changes(self, batch: Sequence[events.Event]) -> list[Update]:
        """What a batch of events, in order, changes on the page."""
        updates: list[Update] = []
        flown = False
        for event in batch:
            match event:
                case events.Started(attempt=attempt):
                    updates += self._started(attempt)
                case events.Progress():
                    updates += self._progress(event)
                case events.Paced():
                    updates += self._paced(event)
                case events.Acted():
                    updates += self._acted(event)
                case events.Samples():
                    self._left.append((event.index, event.flown_at_s))
                    self._stream.push(event)
                    flown = True
                case events.Probabilities():
                    self._windows.append(event)
                    self._is_judged = False
                case events.Diagnosed(diagnosis=diagnosis):
                    self._is_judged = True
                    updates += self.diagnosed(diagnosis)
                case events.Reported(report=report):
                    updates += reported(self.record.id, report)
                case events.Failed():
                    updates += self._failed(event)
                case events.Cancelled():
                    updates += self._state("cancelled")
                case events.Finished():
                    updates += self._state("done")
                    if self._left:
                        updates += self._ended(self._flown_s())
        if flown and self._left:
            updates += self._flown()
        if not self._is_judged and (self._is_paused or time.monotonic() >= self._judge_at_s):
            self._is_judged = True
            self._judge_at_s = time.monotonic() + JUDGED_S
            updates += self._judged()
        return updates

    def _named(self) -> list[Update]:
        """The title of the flight and the actions taken in it."""
        lines = live_controls.action_lines(self.record.fault, self.record.actions)
        return [
            Update("run-title", "children", run_title(self.record)),
            Update("run-subtitle", "children", run_subtitle(self.record)),
            Update(live_controls.ACTIONS_ID, "children", live_controls.action_list(lines)),
            self._marked(ACTION_MARKS_ID, action_marks(lines)),
        ]

    def _paced(self, event: events.Paced) -> list[Update]:
        bar = live_controls.paced(event.pace, event.is_paused)
        updates = [Update(name, prop, value) for (name, prop), value in bar.items()]
        self._is_paused = event.is_paused
        return [*updates, self._stage("flying")] if self._left else updates

    def _acted(self, event: events.Acted) -> list[Update]:
        self.record = replace(self.record, actions=event.actions)
        self.onset_s = _onset_s(self.record)
        self._tiles["onset_s"] = self.onset_s
        return [
            Update("flight", "data", self._tiles),
            Update("scrub", "marks", self._scrub_marks()),
            *self._named(),
        ]

    def _scrub_marks(self) -> list[dict[str, float]]:
        return [] if self.onset_s is None else [{"value": self.onset_s}]

    def _flown_s(self) -> float:
        return float(self._stream.time_s[-1]) if self._left else 0.0

    def tiles(self, time_s: Array, faulted: Array32, mirror: Array32) -> list[Update]:
        """Channels of the finished flight, (n,) and (n, n_channels), with every spike of 50 Hz."""
        ended = self._ended(float(time_s[-1]))
        whole = decimated(time_s, faulted, mirror)
        return [Update("flight", "data", self._tiles | {"whole": whole}), *ended]

    def _ended(self, end_s: float) -> list[Update]:
        """Updates that shorten the time axes of a flight that ended on the ground."""
        planned_s = self.record.plan.duration_s
        if end_s > planned_s - LAST_SAMPLE_S:
            return []
        self.duration_s = self._tiles["duration_s"] = end_s
        return [
            Update("scrub", "max", end_s),
            Update("stage", "children", f"{clock(end_s)} of {clock(planned_s)}"),
        ]

    def strip(self, time_s: Array, faulted: Array32, mirror: Array32) -> list[Update]:
        """The residuals of the same in sigma."""
        strip = heat_strip(
            time_s, faulted - mirror, duration_s=self.duration_s, onset_s=self.onset_s
        )
        return [Update(fly.STRIP_ID, "figure", strip)]

    def happened(self, pair: Pair) -> list[Update]:
        """The events of the finished flight: limits crossed, control lost."""
        found = flight_events(pair.faulted)
        return [
            Update("flight-events", "children", event_list(found)),
            self._marked(LIMIT_MARKS_ID, limit_marks(found)),
        ]

    def diagnosed(self, diagnosis: Diagnosis) -> list[Update]:
        """The verdict: whether it is right, the ranking, the probabilities over the flight."""
        names = {mode: self._names.get(mode, mode) for mode in diagnosis.classes}
        notes = cautions(diagnosis, self.record.plan)
        return [
            Update(OUTCOME_ID, "children", outcome_line(run_outcome(self.record, diagnosis))),
            *self._verdict(
                names, diagnosis.time_s, diagnosis.probabilities_over_time, diagnosis.probabilities
            ),
            self._marked(
                VERDICT_MARKS_ID, verdict_marks(diagnosis, self.record.first_fault or Fault())
            ),
            *cautioned(notes, unsure=False),
        ]

    def _flown(self) -> list[Update]:
        """All samples that the page does not hold yet."""
        stream = self._stream
        start = self._held()
        tiles = self._tiles | stream.since(start)
        # Not for the page: the benchmark measures by it how long samples take to arrive.
        tiles["flown_at_s"] = self._flown_at_s(start * stream.stride)
        updates = [Update("flight", "data", tiles)]
        flown_s = self._flown_s()
        if flown_s - self._strip_s >= self.duration_s / STRIP_FRAMES:
            self._strip_s = flown_s
            residual = stream.faulted - stream.mirror
            strip = heat_strip(
                stream.time_s, residual, duration_s=self.duration_s, onset_s=self.onset_s
            )
            updates.append(Update(fly.STRIP_ID, "figure", strip))
        return updates

    def _flown_at_s(self, index: int) -> float:
        """When the sample of this number left the flight, or the first of its block did."""
        return next((at_s for first, at_s in reversed(self._left) if first <= index), 0.0)

    def _held(self) -> int:
        """The number of samples of this flight that the page reports to hold."""
        if self.taken and self.taken["key"] == self._tiles["key"]:
            return int(self.taken["count"])
        return 0

    def _judged(self) -> list[Update]:
        """The probabilities so far, greyed where an action makes them doubtful."""
        caution = live_caution(self.record.actions, self._windows[-1].time_s)
        return [
            *self._verdict(
                self._names,
                np.array([window.time_s for window in self._windows]),
                np.stack([window.probabilities for window in self._windows]),
                self._windows[-1].probabilities,
            ),
            *cautioned([caution] if caution else [], unsure=caution is not None),
        ]

    def _verdict(
        self, names: dict[str, str], time_s: Array, over_time: Array, now: Array
    ) -> list[Update]:
        ranking = leaders(tuple(names), now)
        figure = probability_figure(
            names, time_s, over_time, ranking, duration_s=self.duration_s, onset_s=self.onset_s
        )
        shares = dict(zip(names, map(float, now), strict=True))
        return [
            Update(fly.PROBABILITIES_ID, "figure", figure),
            Update(fly.RANKING_NODES_ID, "data", nodes(ranking_list(names, ranking, shares))),
            Update(
                TRACK_ID,
                "data",
                track(self.record.id, names, time_s, over_time, class_colours(ranking)),
            ),
        ]

    def _marked(self, store: str, marks: list[Mark]) -> Update:
        """Marks for the charts of this run, which the page may not show yet."""
        return Update(store, "data", {"run": self.record.id, "marks": marks})

    def _progress(self, event: events.Progress) -> list[Update]:
        return [
            Update("progress", "value", round(100 * event.fraction, 1)),
            self._stage(event.stage),
        ]

    def _stage(self, stage: events.Stage) -> Update:
        words = STAGES[stage]
        if stage == "flying" and self._left:
            verb = "Paused at" if self._is_paused else words
            words = f"{verb} {clock(self._flown_s())} of {clock(self.duration_s)}"
        return Update("stage", "children", words)

    def _started(self, attempt: int) -> list[Update]:
        updates = self._state("running")
        if attempt > 1:
            self._begin()
            updates += [*blank(), *resting_charts(self._tiles)]
            again = f"Its worker died. The flight was restarted, attempt {attempt}."
            updates.append(alert("warning", "Restarted", again))
        return updates

    def _failed(self, event: events.Failed) -> list[Update]:
        return [
            *self._state("failed", retryable=event.retryable),
            alert("error", "The run failed", event.message),
        ]

    def _state(self, status: Status, *, retryable: bool = True) -> list[Update]:
        live = status in ("queued", "running")
        done = status == "done"
        can_retry = status == "failed" and retryable
        return [
            *status_updates(status, STATUS_WORDS[status]),
            *button_updates(live=live, finished=not live, retryable=can_retry),
            Update(fly.RESIDUAL_SWITCH_ID, "disabled", not done),
            *([] if live else [
                Update(live_controls.BAR_ID, "hidden", True),
                Update("progress", "value", 100 if done else 0),
                Update("stage", "children", clock(self.duration_s) if done else ""),
            ]),
        ]  # fmt: skip


def _onset_s(record: RunRecord) -> float | None:
    fault = record.first_fault
    return None if fault is None else fault.onset_s
