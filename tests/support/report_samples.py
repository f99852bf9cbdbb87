"""Evidence and diagnoses for the report tests: ideal ones for a mode, and any at all."""

from collections.abc import Sequence

import numpy as np
from hypothesis import strategies as st

from core.channels import CHANNEL_NAMES, channel
from core.diagnosis.diagnosis import Diagnosis, Evidence
from core.fmea.catalogue import class_ids
from core.knowledge.knowledge import knowledge
from core.report.case.case import Case
from core.report.check.checker import CheckedSentence, Checker
from core.report.grounded import GroundedReport, as_markdown
from core.report.sections import ANSWER, SECTIONS, Section
from core.report.sentences import Sentence
from core.report.statement import Statement


def evidence(name: str, value: float, start_s: float = 70.0, end_s: float = 180.0) -> Evidence:
    """One item on channel ``name`` with the sigma of its sensor noise."""
    about = channel(name)
    sd = about.sigma
    direction = "+" if value >= 0.0 else "-"
    return Evidence(
        name, start_s, end_s, value, about.unit, direction, abs(value) / sd, onset_s=start_s
    )


def ideal_evidence(mode_id: str, cylinder: int) -> tuple[Evidence, ...]:
    """What a textbook case of the mode shows: every range at its middle, what is still, still."""
    return tuple(
        evidence(name, (expected.low + expected.high) / 2.0)
        for name, expected in knowledge()[mode_id].signature(cylinder).items()
        if expected.sign in ("+", "-") or (expected.sign == "~" and expected.low != -expected.high)
    )


def diagnosis(
    probabilities: dict[str, float],
    items: Sequence[Evidence] = (),
    *,
    onset_s: float | None = 60.0,
    conditions: str = "lab",
    model: str = "cnn-paired-lab",
    window_tops: Sequence[str] = (),
) -> Diagnosis:
    """A diagnosis with these probabilities (the rest is 0) and this evidence."""
    classes = class_ids()
    vector = np.array([probabilities.get(mode, 0.0) for mode in classes], dtype=np.float32)
    over_time = np.zeros((len(window_tops), len(classes)), dtype=np.float32)
    for row, top in enumerate(window_tops):
        over_time[row, classes.index(top)] = 1.0
    return Diagnosis(
        classes=classes,
        time_s=30.0 + 5.0 * np.arange(len(window_tops)),
        probabilities_over_time=over_time,
        probabilities=vector,
        evidence=tuple(items),
        onset_s=onset_s,
        model=model,
        conditions=conditions,
    )


def section(title: str) -> Section:
    """The section of that title, or an answer for ""."""
    return next((item for item in SECTIONS if item.title == title), ANSWER)


def section_texts(report: GroundedReport) -> dict[str, str]:
    """Each section's Markdown by its title."""
    return {item.title: as_markdown(report.section(item.title)) for item in SECTIONS}


def as_text(statement: Statement) -> Sentence:
    """A statement as the checker of free text reads it."""
    return Sentence(
        statement.markdown, statement.line, statement.marker, statement.indent, statement.first
    )


def rechecked(case: Case) -> list[CheckedSentence]:
    """Every statement of the template about ``case``, read by the checker of free text."""
    checker = Checker(case)
    return [
        checker.check(as_text(statement), part)
        for part in SECTIONS
        for statement in part.write(case)
    ]


TIMES_S = st.floats(0.0, 7200.0)


@st.composite
def any_evidence(draw: st.DrawFn) -> Evidence:
    """Any item that a flight of up to two hours could give, on any channel."""
    name = draw(st.sampled_from(CHANNEL_NAMES))
    full_scale = channel(name).full_scale
    start_s, end_s = sorted(draw(st.tuples(TIMES_S, TIMES_S)))
    size = draw(st.floats(1e-3, 3.0)) * full_scale
    return evidence(name, size * draw(st.sampled_from((-1.0, 1.0))), start_s, end_s)


@st.composite
def any_diagnosis(draw: st.DrawFn) -> Diagnosis:
    """Any probabilities, any evidence, any windows, either conditions."""
    weights = [draw(st.floats(0.0, 1.0)) for _ in class_ids()]
    total = sum(weights) or 1.0
    return diagnosis(
        {mode: weight / total for mode, weight in zip(class_ids(), weights, strict=True)},
        draw(st.lists(any_evidence(), max_size=30)),
        onset_s=draw(st.none() | TIMES_S),
        conditions=draw(st.sampled_from(("lab", "field"))),
        model=draw(st.text(max_size=30)),
        window_tops=draw(st.lists(st.sampled_from(class_ids()), max_size=60)),
    )
