"""Prompts for language models: templates in ``assets/data/prompts``, filled from a case.

Facts are those of the case and the knowledge base alone. Names that users give to runs never enter
a prompt, so they cannot carry an injected instruction; a question does, marked as data.
"""

from dataclasses import dataclass
from functools import cache
from pathlib import Path
from string import Template
from typing import Any

from core.channels import CHANNEL_NAMES
from core.clock import clock
from core.errors import InputError
from core.files import read_toml
from core.paths import DATA
from core.report.case.case import Candidate, Case
from core.report.case.findings import strongest
from core.report.case.wording import (
    cylinder_name,
    expectation,
    interval,
    label,
    labels,
    shift,
    with_cylinder,
)
from core.report.sections import SECTIONS, Section, SectionId
from core.units import percent

Message = dict[str, str]

ANSWER_TOKENS = 200
MAX_QUESTION_CHARS = 500

_PLACEHOLDERS: dict[str, set[str]] = {
    "system.md": set(),
    "facts.md": {"verdict", "confidence", "candidates", "onset", "evidence", "quiet"},
    "knowledge.md": {"knowledge"},
    "section.md": {"title", "task"},
    "question.md": {"question"},
}


@dataclass(frozen=True, slots=True)
class Prompts:
    """The files, checked. ``tasks``: (what to write, tokens it may take) by section."""

    templates: dict[str, Template]
    tasks: dict[SectionId, tuple[str, int]]
    grammar: str

    def section(self, case: Case, section: Section, *, knowledge: bool = True) -> list[Message]:
        """The messages that ask for one section, with or without the knowledge base."""
        task, _ = self.tasks[section.id]
        asked = self._fill("section.md", title=section.title, task=task)
        return self._messages(case, asked, knowledge)

    def question(self, case: Case, question: str, *, knowledge: bool = True) -> list[Message]:
        """The messages that ask a question; raises `InputError` if it is empty or too long."""
        asked = self._fill("question.md", question=checked_question(question).replace(">>>", ""))
        return self._messages(case, asked, knowledge)

    def _messages(self, case: Case, asked: str, knowledge: bool) -> list[Message]:
        parts = [self._fill("facts.md", **_facts(case))]
        if knowledge:
            parts.append(self._fill("knowledge.md", knowledge=_knowledge(case)))
        return [
            {"role": "system", "content": self._fill("system.md")},
            {"role": "user", "content": "\n\n".join([*parts, asked])},
        ]

    def _fill(self, name: str, **values: str) -> str:
        return self.templates[name].substitute(values).strip()


def checked_question(question: str) -> str:
    """A question in one line; raises `InputError` if it is empty or too long."""
    text = " ".join(question.split())
    if not text:
        raise InputError("question", "is empty")
    if len(text) > MAX_QUESTION_CHARS:
        raise InputError("question", f"must be at most {MAX_QUESTION_CHARS} characters long")
    return text


@cache
def prompts() -> Prompts:
    """The prompts of the installation; raises `InputError` on a bad file."""
    return read_prompts(DATA / "prompts")


def read_prompts(folder: Path) -> Prompts:
    """Read and check a folder of prompts; raises `InputError` by file."""
    templates = {}
    for name, wanted in _PLACEHOLDERS.items():
        template = Template(_text(folder / name))
        if not template.is_valid() or set(template.get_identifiers()) != wanted:
            raise InputError(name, f"must use exactly the placeholders {sorted(wanted)}")
        templates[name] = template
    tables = read_toml(folder / "tasks.toml", "tasks.toml")
    if unknown := tables.keys() - {section.id for section in SECTIONS}:
        raise InputError("tasks.toml", f"has unknown sections {sorted(unknown)}")
    tasks = {section.id: _task(section.id, tables.get(section.id)) for section in SECTIONS}
    return Prompts(templates, tasks, _text(folder / "section.gbnf"))


def _text(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(path.name, f"cannot be read: {error}") from None


def _task(section_id: str, table: Any) -> tuple[str, int]:
    match table:
        case {"task": str(task), "max_tokens": int(tokens)} if task and tokens > 0:
            return task, tokens
    raise InputError(f"tasks.toml, {section_id}", "must have task (text) and max_tokens (above 0)")


def _facts(case: Case) -> dict[str, str]:
    moved = strongest(case.evidence)
    still = [name for name in CHANNEL_NAMES if name not in moved]
    where = case.cylinder_of(case.top.mode)
    place = f" at {cylinder_name(where)}" if where else ""
    onset_s = case.diagnosis.onset_s
    return {
        "verdict": f"none of these; the nearest is {case.top.mode.name}"
        if case.diagnosis.none_of_these
        else f"{case.top.mode.name}{place}",
        "confidence": case.confidence,
        "candidates": ", ".join(
            f"{item.mode.name} {percent(item.probability)}" for item in case.candidates
        ),
        "onset": "none" if onset_s is None else clock(onset_s),
        "evidence": "; ".join(
            f"{label(name)} {shift(item)} ({interval(item)})" for name, item in moved.items()
        )
        or "none",
        "quiet": labels(still) or "none",
    }


def _knowledge(case: Case) -> str:
    return "\n\n".join(
        [_known(case, case.top, whole=True)]
        + [_known(case, rival, whole=False) for rival in case.candidates[1:]]
    )


def _known(case: Case, candidate: Candidate, *, whole: bool) -> str:
    """The knowledge of a candidate: all of it for the verdict, of the others what they predict."""
    mode, cylinder = candidate.mode, case.cylinder_of(candidate.mode)
    signature = mode.signature(candidate.finding.cylinder)
    predicted = "; ".join(
        f"{label(name)} should {expectation(item, name)}"
        for name, item in signature.items()
        if item.sign in ("+", "-")
    )
    lines = [f"{mode.name}: {mode.summary}", f"Predicts: {predicted or 'nothing moves'}."]
    if whole:
        lines += [f"Step {n}: {step.text}" for n, step in enumerate(mode.chain, start=1)]
        lines += [f"Action {n}: {action}" for n, action in enumerate(mode.actions, start=1)]
    return "\n".join(with_cylinder(line, cylinder) for line in lines)
