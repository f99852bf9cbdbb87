"""The fifth section: what to inspect and to do, in order."""

from collections.abc import Iterator

from core.report.case.case import Candidate, Case
from core.report.case.wording import with_cylinder
from core.report.statement import Statement, item, paragraph, prose, say


def maintenance(case: Case) -> tuple[Statement, ...]:
    """What to do, numbered; where the first candidate is not firm, the second's actions follow."""
    return tuple(_maintenance(case))


def _maintenance(case: Case) -> Iterator[Statement]:
    order = case.work_order
    if case.confidence == "low" and order[0].mode.id != "nominal":
        yield from _caution(
            "The diagnosis is not firm: inspect first, change parts only on a finding."
        )
    done = 0
    for candidate in order:
        if len(order) > 1 or case.doubts_nominal:
            lead = "If that does not resolve it, for" if done else "For"
            yield from paragraph(
                say("introduction", f"{lead} {candidate.mode.name}:", mode=candidate.mode.id)
            )
        for action in _actions(case, candidate):
            done += 1
            what = prose(
                "action", action, rests_on=("knowledge",), mode=candidate.mode.id, step=done
            )
            yield from item(f"{done}.", *what)
    yield from _caution(
        "Manufacturer's manuals and airworthiness directives take precedence over this report."
    )


def _caution(text: str) -> tuple[Statement, ...]:
    return paragraph(*prose("caution", text))


def _actions(case: Case, candidate: Candidate) -> list[str]:
    cylinder = case.cylinder_of(candidate.mode)
    return [with_cylinder(action, cylinder) for action in candidate.mode.actions]
