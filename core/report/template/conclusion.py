"""The first section of the report: the verdict, how sure it is and why, and its doubts."""

from collections.abc import Iterator

from core.clock import clock
from core.knowledge.knowledge import ModeKnowledge
from core.report.case.case import Case
from core.report.case.wording import bank_name, cylinder_name, labels
from core.report.statement import Basis, Statement, item, paragraph, prose, say
from core.units import percent


def conclusion(case: Case) -> tuple[Statement, ...]:
    """Verdict and confidence, the leading candidates, the onset and the FMEA rating."""
    return (
        *paragraph(*_verdict(case)),
        *paragraph(*_confidence(case)),
        *_doubts(case),
        *_ranking(case),
        *paragraph(onset(case), *_persistence(case)),
        *paragraph(*_interventions(case)),
        *paragraph(*_rating(case.top.mode)),
        *paragraph(_classifier(case)),
    )


def _verdict(case: Case) -> Iterator[Statement]:
    """The headline, and what the mode is."""
    mode = case.top.mode
    yield say(
        "verdict", "", strong=_headline(case), rests_on=("verdict",), mode=mode.id, concludes=True
    )
    if not case.doubts_nominal:
        yield from prose("verdict", mode.summary, rests_on=("knowledge",), mode=mode.id)


def _ranking(case: Case) -> Iterator[Statement]:
    for rank, each in enumerate(case.candidates, start=1):
        yield from item(
            f"{rank}.",
            say(
                "candidate",
                f"{each.mode.name}: {percent(each.probability)}",
                rests_on=("verdict",),
                mode=each.mode.id,
                concludes=rank == 1,
            ),
        )


def _headline(case: Case) -> str:
    top = case.top
    if case.diagnosis.none_of_these:
        return f"None of these; {top.mode.name} is the nearest."
    if case.is_close:
        return f"Open between {top.mode.name} and {case.candidates[1].mode.name}."
    if case.doubts_nominal:
        return "Nominal by the classifier, but not by the evidence."
    if top.mode.id == "nominal":
        return "No fault found."
    return f"{top.mode.name}{_place(case, top.mode)}."


def _place(case: Case, mode: ModeKnowledge) -> str:
    """Where the mode sits, as the evidence has it, or nothing."""
    cylinder = case.cylinder_of(mode)
    if cylinder is None:
        return ""
    if any(item.channel == "CHT bank" for item in mode.channels):
        return f", {bank_name(cylinder)}"
    return f" at {cylinder_name(cylinder)}"


def _confidence(case: Case) -> Iterator[Statement]:
    """How sure the report sounds, and why."""
    finding = case.top.finding
    yield say("confidence", "", strong=f"Confidence: {case.confidence}.")
    lead = f"The classifier gives it {percent(case.top.probability)}"
    if len(case.candidates) > 1:
        points = min(99, round(100 * case.margin))
        lead += f", {points} points ahead of {case.candidates[1].mode.name}"
    yield say("confidence", f"{lead}.", rests_on=("verdict",), concludes=True)
    if finding.predicted:
        found = f"{len(finding.confirmed)} of {len(finding.predicted)}"
        yield say("confidence", f"Expected shifts found: {found}.", rests_on=("sensor",))
    conflicts = _counted(len(finding.having("conflicts")), "conflict", "conflicts")
    yield say("confidence", f"Against it: {conflicts}.")


def _counted(count: int, one: str, more: str) -> str:
    return f"{count or 'no'} {one if count == 1 else more}"


def _doubts(case: Case) -> Iterator[Statement]:
    """What a careful reader has to know before acting on the headline, a paragraph each."""
    top, finding = case.top, case.top.finding
    if case.diagnosis.none_of_these:
        yield from _doubt(
            "This flight resembles nothing that the classifier was trained on: take the ranking "
            "as a guess."
        )
    nominal = top.mode.id == "nominal"
    channels = tuple(check.channel for check in finding.having("conflicts"))
    conflicts = labels(channels)
    if case.is_close:
        yield from _doubt(
            "The lead is too small to choose: treat both as open until an inspection decides. "
            "The differential says what to look for."
        )
    if not case.evidence and not nominal:
        yield from _doubt("No channel left its noise, so nothing measured supports this verdict.")
    elif nominal and case.parts_unseen:
        yield from _doubt("The two flights part, but no channel left its noise.")
    elif conflicts and nominal:
        yield from _doubt(
            f"Something moved that should not in a healthy aircraft: {conflicts}.", channels
        )
    elif conflicts:
        yield from _doubt(
            f"The evidence does not fit in {conflicts}: see the cross-check.", channels
        )
    if rival := case.better_explained:
        yield from _doubt(f"{rival.mode.name} would explain all of the evidence: check it as well.")
    if nominal and not conflicts and not case.parts_unseen:
        yield from _doubt(
            "A fault that is too small or too slow for these sensors would look the same; "
            "the differential names the usual ones."
        )
    if doubt := _cylinder_doubt(case):
        yield from paragraph(*prose("doubt", doubt, rests_on=("verdict",)))


def _doubt(text: str, channels: tuple[str, ...] = ()) -> tuple[Statement, ...]:
    basis: tuple[Basis, ...] = ("sensor",) if channels else ()
    return paragraph(*prose("doubt", text, rests_on=basis, channels=channels))


def _cylinder_doubt(case: Case) -> str:
    mode = case.top.mode
    if not mode.names_cylinder:
        return ""
    if case.hit is None:
        usual = mode.usual_cylinder or 1
        share = percent(mode.cylinder_share[usual - 1])
        return (
            "No head or exhaust temperature left its noise, so the cylinder stays open; "
            f"records favour {cylinder_name(usual)} with {share}."
        )
    if case.hit.clear or case.hit.runner_up is None or _place(case, mode).startswith(","):
        return ""
    return f"{cylinder_name(case.hit.runner_up).capitalize()} moved nearly as far: check both."


def onset(case: Case) -> Statement:
    """When the two flights part, or that they do not."""
    onset_s, in_field = case.diagnosis.onset_s, case.diagnosis.conditions == "field"
    if onset_s is None:
        text = (
            "No onset: nothing left the range of healthy flights."
            if in_field
            else "No onset: the two flights did not part."
        )
        return say("onset", text)
    text = (
        f"From {clock(onset_s)} on the flight departs from healthy ones (estimated onset)."
        if in_field
        else f"The two flights part at {clock(onset_s)} (estimated onset)."
    )
    return say("onset", text, rests_on=("sensor",))


def _persistence(case: Case) -> Iterator[Statement]:
    """Since when the classifier has named its verdict without a break, or what it names later."""
    if len(case.diagnosis.time_s) == 0 or case.diagnosis.onset_s is None:
        return
    if case.stands_since_s is not None:
        text = f"Every window ending at {clock(case.stands_since_s)} or later names it."
        yield say("onset", text, rests_on=("verdict",))
        return
    for later in case.later:
        text = (
            f"Of {later.of} windows after the onset {later.windows} name "
            f"{case.weighed[later.mode].mode.name} instead of it, the first ending at "
            f"{clock(later.first_s)}."
        )
        yield say("onset", text, rests_on=("verdict",), mode=later.mode)


def _interventions(case: Case) -> Iterator[Statement]:
    """What was done on the way, and what follows from it for the evidence."""
    until_s = case.diagnosis.judged_until_s
    for done in case.diagnosis.interventions:
        at = clock(done.time_s)
        if done.kind == "target":
            text = f"New targets for both aircraft at {at}: {done.targets}."
        elif done.kind == "ground":
            text = f"The flight ends on the ground at {at}."
        elif done.time_s == until_s:
            text = f"Repaired at {at}: nothing later is evidence."
        else:
            text = f"Repaired at {at}."
        yield say("intervention", text, rests_on=("flight",))


def _rating(mode: ModeKnowledge) -> Iterator[Statement]:
    if mode.id == "nominal":
        return
    yield from prose(
        "rating",
        f"FMEA rating (1-10): severity {mode.severity}, occurrence {mode.occurrence}, "
        f"detection {mode.detection}; RPN {mode.rpn}. ATA {mode.ata}. Records: {mode.records}",
        rests_on=("knowledge",),
        mode=mode.id,
    )


def _classifier(case: Case) -> Statement:
    model = " ".join(case.diagnosis.model.split())
    return say("classifier", f"Classifier {model}, {case.diagnosis.conditions} conditions.")
