"""Runs in words: titles, plans, stages and flight events, with their units."""

from collections.abc import Iterable, Sequence

from core.channels import channel, unit_label
from core.clock import clock
from core.diagnosis.diagnosis import Diagnosis
from core.fmea.catalogue import catalogue
from core.fmea.fault import Fault
from core.jobs.events import Stage
from core.store.records import RunRecord, Status
from core.twin.actions import Action, Repair, SetTarget
from core.twin.events import FlightEvent
from core.twin.plan import Plan

STAGES: dict[Stage, str] = {
    "waiting": "Waiting for a worker",
    "no_worker": "Waiting: no worker is connected. The run fails unless one connects soon",
    "flying": "Flying",
    "diagnosing": "Diagnosing",
    "reporting": "Writing the report",
    "storing": "Storing",
}

STATUS_WORDS: dict[Status, str] = {
    "queued": "Queued",
    "running": "Flying",
    "done": "Done",
    "failed": "Failed",
    "cancelled": "Cancelled",
}


_EVENT_NAMES = {
    "stall": "stall, angle of attack",
    "lost_control": "control lost, bank",
}


def mode_name(mode: str) -> str:
    """The name of a mode; its id where the catalogue has dropped it."""
    modes = catalogue()
    return modes[mode].name if mode in modes else mode


def takes_cylinder(mode: str) -> bool:
    """Whether a mode hits one cylinder, so that choosing it means something."""
    modes = catalogue()
    return mode in modes and mode != "nominal" and not modes[mode].whole_engine


def flown_fault(record: RunRecord) -> Fault:
    """The fault of a flight; of a live one, the first one injected."""
    return record.first_fault or Fault("nominal")


def run_title(record: RunRecord) -> str:
    """The fault of a run in a few words: what, where and how bad."""
    fault = record.first_fault
    if fault is None:
        return mode_name("nominal")
    where = f", cylinder {fault.target_cylinder}" if takes_cylinder(fault.mode) else ""
    return f"{mode_name(fault.mode)}{where}, severity {fault.severity:.2f}"


def sentence(text: str) -> str:
    """A message as a sentence.

    >>> sentence("cannot write there")
    'Cannot write there.'
    """
    return f"{text[:1].upper()}{text[1:]}" + ("" if text.endswith(".") else ".")


def short_titles(records: Sequence[RunRecord]) -> list[str]:
    """The shortest distinct title of each run."""
    modes = [flown_fault(record).mode for record in records]
    titles = [run_title(record) for record in records]
    return [
        mode_name(mode)
        if modes.count(mode) == 1
        else title
        if titles.count(title) == 1
        else f"{title}, seed {record.plan.seed}"
        for record, mode, title in zip(records, modes, titles, strict=True)
    ]


def run_subtitle(record: RunRecord) -> str:
    """The plan of a run in one line, with units."""
    plan, fault = record.plan, record.first_fault
    parts = [
        "no onset" if fault is None else f"onset {clock(fault.onset_s)}",
        f"{plan.altitude_ft:,.0f} ft",
        f"{plan.speed_kt:.0f} kt",
        f"heading {plan.heading_deg:03.0f}°",
        f"{clock(plan.duration_s)} long",
        plan.conditions,
        f"seed {plan.seed}",
    ]
    weather = plan.weather
    if plan.power == "speed_hold":
        parts.append("speed hold")
    if weather.isa_deviation_degc:
        parts.append(f"ISA {weather.isa_deviation_degc:+g} °C")
    if weather.wind_kt:
        parts.append(f"wind {weather.wind_from_deg:03.0f}° {weather.wind_kt:g} kt")
    if weather.turbulence:
        parts.append(f"turbulence {weather.turbulence:g}")
    if plan.legs:
        parts.append(f"{len(plan.legs)} legs")
    if record.actions:
        parts.append(f"{len(record.actions)} action{'s' if len(record.actions) > 1 else ''}")
    return ", ".join(parts)


def ground_line(ground_s: float) -> str:
    """How a flight ends that meets the ground."""
    return (
        f"The flight ends at {clock(ground_s)}: the aircraft met the ground "
        "(sea level; no terrain is simulated)"
    )


def event_line(event: FlightEvent) -> str:
    """An excursion of a flight: when, what and how far; or its end on the ground."""
    if event.kind == "ground":
        return ground_line(event.start_s)
    unit = unit_label(event.unit)
    times = f"{clock(event.start_s)} to {clock(event.end_s)}"
    if event.kind in _EVENT_NAMES:
        return f"{times}: {_EVENT_NAMES[event.kind]}, {event.value:.0f}{unit}"
    limit = channel(event.kind)
    side = "above" if event.value > event.limit else "below"
    worst = f"{event.value:.{limit.decimals}f}"
    return f"{times}: {limit.label} {side} {event.limit:g} {unit}, worst {worst} {unit}"


def cautions(diagnosis: Diagnosis, plan: Plan) -> list[str]:
    """Cautions about a diagnosis, most serious first."""
    notes = []
    if diagnosis.none_of_these:
        notes.append(
            "None of these: the flight resembles no class that the classifier was trained on. The "
            "ranking lists the nearest classes only."
        )
    if diagnosis.conditions != plan.conditions:
        notes.append(
            f"The classifier was trained on {diagnosis.conditions} flights, and this is a "
            f"{plan.conditions} flight: expect more errors than its scores suggest."
        )
    if diagnosis.judged_until_s is not None:
        notes.append(
            f"Repaired at {clock(diagnosis.judged_until_s)}: the verdict is for the flight "
            "before the repair; nothing later is evidence."
        )
    return notes


STEERED_S = 120.0
"""How long after new targets both aircraft are assumed to be in transition."""


def live_caution(actions: Iterable[Action], now_s: float) -> str | None:
    """A caution about the ranking of a live flight at ``now_s`` after an action; else None.

    After a repair the aircraft returns to its mirror, until another fault is injected; after new
    targets both fly a transition that no model was trained on.
    """
    done = [action for action in actions if action.time_s <= now_s]
    last = max(
        (each for each in done if not isinstance(each, SetTarget)),
        key=lambda each: each.time_s,
        default=None,
    )
    if isinstance(last, Repair):
        return (
            f"Repaired at {clock(last.time_s)}: the aircraft is still returning to its mirror. "
            "This ranking is not a diagnosis of the repaired engine."
        )
    steered = [each.time_s for each in done if isinstance(each, SetTarget)]
    if steered and now_s - max(steered) < STEERED_S:
        return (
            f"New targets at {clock(max(steered))}: until both aircraft have reached them, this "
            "ranking is unreliable."
        )
    return None
