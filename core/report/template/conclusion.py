"""The first section of the report: the verdict, how sure it is and why, and its doubts."""

from core.clock import clock
from core.knowledge.knowledge import ModeKnowledge
from core.report.case.case import Case
from core.report.case.wording import bank_name, cylinder_name, labels, percent, plain


def conclusion(case: Case) -> str:
    """Verdict and confidence, the leading candidates, the onset and the FMEA rating."""
    top = case.top
    ranking = "\n".join(
        f"{rank}. {item.mode.name}: {percent(item.probability)}"
        for rank, item in enumerate(case.candidates, start=1)
    )
    parts = [
        f"**{_headline(case)}**"
        if case.doubts_nominal
        else f"**{_headline(case)}** {top.mode.summary}",
        f"**Confidence: {case.confidence}.** {_reasons(case)}",
        *_hedges(case),
        ranking,
        f"{onset_sentence(case)} {_persistence(case)}".strip(),
        _interventions(case),
        _rating(top.mode),
        f"Classifier {plain(case.diagnosis.model)}, {plain(case.diagnosis.conditions)} conditions.",
    ]
    return "\n\n".join(part for part in parts if part)


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


def _reasons(case: Case) -> str:
    finding = case.top.finding
    lead = f"The classifier gives it {percent(case.top.probability)}"
    if len(case.candidates) > 1:
        points = min(99, round(100 * case.margin))
        lead += f", {points} points ahead of {case.candidates[1].mode.name}"
    conflicts = _counted(len(finding.having("conflicts")), "conflict", "conflicts")
    if not finding.predicted:
        return f"{lead}. Against it: {conflicts}."
    confirmed, predicted = len(finding.confirmed), len(finding.predicted)
    return f"{lead}. Expected shifts found: {confirmed} of {predicted}. Against it: {conflicts}."


def _counted(count: int, one: str, more: str) -> str:
    return f"{count or 'no'} {one if count == 1 else more}"


def _hedges(case: Case) -> list[str]:
    """What a careful reader has to know before acting on the headline."""
    top, hedges = case.top, []
    if case.diagnosis.none_of_these:
        hedges.append(
            "This flight resembles nothing that the classifier has learnt: take the ranking as a "
            "guess."
        )
    nominal = top.mode.id == "nominal"
    conflicts = labels(check.channel for check in top.finding.having("conflicts"))
    if case.is_close:
        hedges.append(
            "The lead is too small to choose: treat both as open until an inspection decides. "
            "The differential says what to look for."
        )
    if not case.evidence and not nominal:
        hedges.append("No channel left its noise, so nothing measured supports this verdict.")
    elif nominal and case.parts_unseen:
        hedges.append("The two flights part, but no channel left its noise.")
    elif conflicts and nominal:
        hedges.append(f"Something moved that should not in a healthy aircraft: {conflicts}.")
    elif conflicts:
        hedges.append(f"The evidence does not fit in {conflicts}: see the cross-check.")
    if rival := case.better_explained:
        hedges.append(f"{rival.mode.name} would explain all of the evidence: check it as well.")
    if nominal and not conflicts and not case.parts_unseen:
        hedges.append(
            "A fault that is too small or too slow for these sensors would look the same; "
            "the differential names the usual ones."
        )
    if doubt := _cylinder_doubt(case):
        hedges.append(doubt)
    return hedges


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


def onset_sentence(case: Case) -> str:
    """When the two flights part, or that they do not."""
    onset_s, in_field = case.diagnosis.onset_s, case.diagnosis.conditions == "field"
    if onset_s is None:
        return (
            "No onset: nothing left what healthy flights do."
            if in_field
            else "No onset: the two flights did not part."
        )
    if in_field:
        return f"From {clock(onset_s)} on the flight departs from healthy ones (estimated onset)."
    return f"The two flights part at {clock(onset_s)} (estimated onset)."


def _persistence(case: Case) -> str:
    """Since when the classifier has named its verdict without a break, or what it names later."""
    if len(case.diagnosis.time_s) == 0 or case.diagnosis.onset_s is None:
        return ""
    if case.stands_since_s is not None:
        return f"Every window ending at {clock(case.stands_since_s)} or later names it."
    return " ".join(
        f"Of {item.of} windows after the onset {item.windows} name "
        f"{case.weighed[item.mode].mode.name} instead of it, the first ending at "
        f"{clock(item.first_s)}."
        for item in case.later
    )


def _interventions(case: Case) -> str:
    """What was done on the way, and what follows from it for the evidence."""
    said = []
    until_s = case.diagnosis.judged_until_s
    for item in case.diagnosis.interventions:
        at = clock(item.time_s)
        if item.kind == "target":
            said.append(f"New targets for both aircraft at {at}: {item.targets}.")
        elif item.kind == "ground":
            said.append(f"The flight ends on the ground at {at}.")
        elif item.time_s == until_s:
            said.append(f"Repaired at {at}: nothing later is evidence.")
        else:
            said.append(f"Repaired at {at}.")
    return " ".join(said)


def _rating(mode: ModeKnowledge) -> str:
    if mode.id == "nominal":
        return ""
    return (
        f"FMEA rating (1-10): severity {mode.severity}, occurrence {mode.occurrence}, "
        f"detection {mode.detection}; RPN {mode.rpn}. ATA {mode.ata}. Records: {mode.records}"
    )
