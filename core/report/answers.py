"""Answers to questions about a report, made of its evidence and the knowledge base alone."""

import re
from collections.abc import Iterator

from core.knowledge.knowledge import knowledge
from core.knowledge.lexicon import lexicon, stems
from core.knowledge.search import search
from core.report.case.case import Candidate, Case
from core.report.case.findings import strongest
from core.report.case.wording import (
    expectation,
    interval,
    label,
    shift,
    sigma,
    with_cylinder,
)
from core.report.check.mentions import channel_mentions, mode_mentions
from core.report.statement import Statement, item, paragraph, prose, say
from core.report.template.conclusion import onset
from core.report.template.differential import weigh
from core.report.template.maintenance import maintenance
from core.units import percent

MAX_CHANNELS = 4
MAX_PASSAGES = 3
"""Channels and passages of the knowledge base that one answer names."""

_ACTION = re.compile(r"\b(?:do|fix|repair|inspect|check|replace|maint\w+|action|fly|safe)\b")
_WHERE = re.compile(r"\b(?:cylinder|which one|where|location)\b")
_WHEN = re.compile(r"\b(?:when|onset|start\w*|began|begin)\b")
_SURE = re.compile(r"\b(?:sure|certain|confiden\w+|probab\w+|likely|trust|believe)\b")


def modes_meant(question: str) -> tuple[str, ...]:
    """The modes that a question is about: those it names, or else those whose name it half says."""
    named = tuple(dict.fromkeys(each.mode for each in mode_mentions(question)))
    if named:
        return named
    asked = frozenset(stems(question))
    plain = {"engin", "cylind", "problem", "mainten", "requir"}
    scores = {
        mode.id: len((frozenset(stems(mode.name)) - plain) & asked) for mode in knowledge().values()
    }
    best = max(scores.values())
    return tuple(mode for mode, score in scores.items() if score == best and best > 0)[:3]


def offline_answer(case: Case, question: str) -> tuple[Statement, ...]:
    """An answer from what is known and measured alone."""
    asked = question.casefold()
    found: list[Statement] = []
    for mode in modes_meant(question):
        if mode in case.weighed:
            found += _about_mode(case, case.weighed[mode])
    channels = dict.fromkeys(
        name for mention in channel_mentions(question) if mention.exact for name in mention.channels
    )
    for name in list(channels)[:MAX_CHANNELS]:
        found += _about_channel(case, name)
    if not found:
        for pattern, answer in (
            (_WHEN, _when),
            (_WHERE, _where),
            (_SURE, _how_sure),
            (_ACTION, maintenance),
        ):
            if pattern.search(asked):
                found += answer(case)
    return tuple(found or _found(case, question))


def _about_mode(case: Case, candidate: Candidate) -> Iterator[Statement]:
    """Why it is, or is not, this mode."""
    mode, finding = candidate.mode, candidate.finding
    if mode.id != case.top.mode.id:
        yield from weigh(case, candidate)
        return
    odds = percent(candidate.probability)
    shifts = f"{len(finding.confirmed)} of {len(finding.predicted)}"
    yield from paragraph(
        say(
            "answer",
            f"{mode.name} is the verdict, with a probability of {odds}.",
            rests_on=("verdict",),
            mode=mode.id,
        ),
        say("answer", f"Expected shifts found: {shifts}.", rests_on=("sensor",)),
    )
    yield from paragraph(*prose("answer", mode.summary, rests_on=("knowledge",), mode=mode.id))


def _about_channel(case: Case, name: str) -> Iterator[Statement]:
    moved = strongest(case.evidence).get(name)
    expected = case.top.mode.signature(case.top.finding.cylinder).get(name)
    text = (
        f"{label(name)} {shift(moved)} ({sigma(moved.sigma)}), {interval(moved)}."
        if moved
        else f"{label(name)} stayed within noise."
    )
    if expected is not None and expected.sign != "~":
        text += f" With {case.top.mode.name}, {label(name)} should {expectation(expected, name)}."
    yield from paragraph(*prose("answer", text, rests_on=("sensor",), channels=(name,)))


def _when(case: Case) -> tuple[Statement, ...]:
    return paragraph(onset(case))


def _where(case: Case) -> tuple[Statement, ...]:
    if case.hit is None or not case.top.mode.names_cylinder:
        return ()
    text = f"The evidence points to cylinder {case.hit.cylinder}."
    return paragraph(say("answer", text, rests_on=("verdict",)))


def _how_sure(case: Case) -> tuple[Statement, ...]:
    odds = f"The classifier gives {case.top.mode.name} {percent(case.top.probability)}."
    return paragraph(
        say("answer", f"Confidence: {case.confidence}."),
        say("answer", odds, rests_on=("verdict",), mode=case.top.mode.id),
    )


def _found(case: Case, question: str) -> Iterator[Statement]:
    """The passages of this case's knowledge that match the question best."""
    if not _says_something(question):
        text = "Ask about a fault, a channel, a time, a cylinder, or what to do."
        yield from paragraph(say("answer", text))
        return
    hits = [hit for hit in search(question, limit=40) if hit.mode in case.weighed]
    if not hits:
        text = "Neither the evidence nor the knowledge of these faults says anything."
        yield from paragraph(say("answer", text))
    cylinder = case.hit.cylinder if case.hit else None
    for hit in hits[:MAX_PASSAGES]:
        text = with_cylinder(hit.text, cylinder)
        yield from item("-", *prose("answer", text, rests_on=("knowledge",), mode=hit.mode))


def _says_something(question: str) -> bool:
    """Whether a question has any technical word."""
    words = re.findall(r"[a-z]+", question.casefold())
    return any(not lexicon().is_plain(word) for word in words)
