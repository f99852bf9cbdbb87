"""Answers to questions about a report, from its evidence and the knowledge base alone."""

import re

from core.channels import CHANNEL_INDEX
from core.knowledge.knowledge import knowledge
from core.knowledge.lexicon import lexicon, stems
from core.knowledge.search import search
from core.report.case.case import Candidate, Case
from core.report.case.findings import strongest
from core.report.case.wording import (
    expectation,
    interval,
    label,
    percent,
    shift,
    sigma,
    with_cylinder,
)
from core.report.check.mentions import channel_mentions, mode_mentions
from core.report.template.conclusion import onset_sentence
from core.report.template.differential import weigh
from core.report.template.template import maintenance

MAX_PASSAGES = 3

_ACTION = re.compile(r"\b(?:do|fix|repair|inspect|check|replace|maint\w+|action|fly|safe)\b")
_WHERE = re.compile(r"\b(?:cylinder|which one|where|location)\b")
_WHEN = re.compile(r"\b(?:when|onset|start\w*|began|begin)\b")
_SURE = re.compile(r"\b(?:sure|certain|confiden\w+|probab\w+|likely|trust|believe)\b")


def modes_meant(question: str) -> tuple[str, ...]:
    """The modes that a question is about: those it names, or else those whose name it half says."""
    named = tuple(dict.fromkeys(item.mode for item in mode_mentions(question)))
    if named:
        return named
    asked = frozenset(stems(question))
    plain = {"engin", "cylind", "problem", "mainten", "requir"}
    scores = {
        mode.id: len((frozenset(stems(mode.name)) - plain) & asked) for mode in knowledge().values()
    }
    best = max(scores.values())
    return tuple(mode for mode, score in scores.items() if score == best and best > 0)[:3]


def offline_answer(case: Case, question: str) -> str:
    """An answer in Markdown, from what is known and measured alone."""
    asked = question.casefold()
    parts: list[str] = []
    for mode in modes_meant(question):
        if mode in case.weighed:
            parts.append(_about_mode(case, case.weighed[mode]))
    channels = dict.fromkeys(
        name for item in channel_mentions(question) if item.exact for name in item.channels
    )
    parts += [_about_channel(case, name) for name in list(channels)[:4]]
    if not parts:
        parts = [
            text
            for pattern, text in (
                (_WHEN, onset_sentence(case)),
                (_WHERE, _where(case)),
                (_SURE, _how_sure(case)),
                (_ACTION, maintenance(case)),
            )
            if pattern.search(asked)
        ]
    return "\n\n".join(parts) or _found(case, question)


def _about_mode(case: Case, candidate: Candidate) -> str:
    """Why it is, or is not, this mode."""
    if candidate.mode.id == case.top.mode.id:
        finding = candidate.finding
        return (
            f"{candidate.mode.name} is the verdict, with a probability of "
            f"{percent(candidate.probability)}. Expected shifts found: {len(finding.confirmed)} of "
            f"{len(finding.predicted)}.\n\n{candidate.mode.summary}"
        )
    return weigh(case, candidate)


def _about_channel(case: Case, name: str) -> str:
    assert name in CHANNEL_INDEX
    item = strongest(case.evidence).get(name)
    expected = case.top.mode.signature(case.top.finding.cylinder).get(name)
    said = (
        f"{label(name)} {shift(item)} ({sigma(item.sigma)}), {interval(item)}."
        if item
        else f"{label(name)} stayed within noise."
    )
    if expected is not None and expected.sign != "~":
        said += f" With {case.top.mode.name}, {label(name)} should {expectation(expected, name)}."
    return said


def _where(case: Case) -> str:
    if case.hit is None or not case.top.mode.names_cylinder:
        return ""
    return f"The evidence points to cylinder {case.hit.cylinder}."


def _how_sure(case: Case) -> str:
    return (
        f"Confidence: {case.confidence}. The classifier gives {case.top.mode.name} "
        f"{percent(case.top.probability)}."
    )


def _found(case: Case, question: str) -> str:
    """What the knowledge of this case says that comes nearest to the question."""
    if not lexicon_terms(question):
        return "Ask about a fault, a channel, a time, a cylinder, or what to do."
    hits = [hit for hit in search(question, limit=40) if hit.mode in case.weighed]
    cylinder = case.hit.cylinder if case.hit else None
    lines = [f"- {with_cylinder(hit.text, cylinder)}" for hit in hits[:MAX_PASSAGES]]
    return (
        "\n".join(lines) or "Neither the evidence nor the knowledge of these faults says anything."
    )


def lexicon_terms(question: str) -> bool:
    """Whether a question holds any word that says something."""
    words = re.findall(r"[a-z]+", question.casefold())
    return any(not lexicon().is_plain(word) for word in words)
