"""The knowledge base as single sentences, to which a sentence of a report can be traced."""

import re
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cache
from typing import Literal

from core.cylinders import CYLINDERS
from core.knowledge.knowledge import ModeKnowledge, knowledge
from core.knowledge.lexicon import stems, terms
from core.report.case.wording import with_cylinder
from core.report.check.mentions import Quantity, quantities
from core.report.sentences import plain_text, sentences

KnownKind = Literal["summary", "mechanism", "chain", "tell", "action", "ata", "records"]

_LABEL = re.compile(r"^(?:difference|tell|records|ata|step \d|action)\s*:?\s+", re.IGNORECASE)
_EDGE = " .,;:!?()\"'"


@dataclass(frozen=True, slots=True)
class KnownSentence:
    """One sentence of the knowledge of ``mode``; ``step`` counts causal steps and actions from 1.

    ``terms``: stems of its words that say something. ``about``: for a tell, the look-alike.
    """

    mode: str
    kind: KnownKind
    step: int
    text: str
    terms: frozenset[str]
    about: str | None


def normal(text: str) -> str:
    """A text as quotes are compared: lower case, single spaces, no marks at its ends."""
    bare = plain_text(text).replace("’", "'").casefold().strip(_EDGE)
    return _LABEL.sub("", bare).strip(_EDGE)


@cache
def known_sentences(mode_id: str) -> tuple[KnownSentence, ...]:
    """All sentences of a mode, as the file has them ("the affected cylinder")."""
    return tuple(_sentences(knowledge()[mode_id]))


def _sentences(mode: ModeKnowledge) -> Iterator[KnownSentence]:
    texts: list[tuple[KnownKind, int, str, str | None]] = [
        ("summary", 0, mode.summary, None),
        ("mechanism", 0, mode.mechanism, None),
        ("ata", 0, mode.ata, None),
        ("records", 0, mode.records, None),
    ]
    texts += [("chain", step, item.text, None) for step, item in enumerate(mode.chain, start=1)]
    texts += [("tell", 0, item.tell, item.mode) for item in mode.look_alikes]
    texts += [("action", step, text, None) for step, text in enumerate(mode.actions, start=1)]
    for kind, step, text, about in texts:
        for sentence in sentences(text):
            yield KnownSentence(mode.id, kind, step, sentence.plain, terms(sentence.plain), about)


@cache
def passages(mode_id: str) -> tuple[KnownSentence, ...]:
    """The sentences of a mode, joined where they belong to one step or action."""
    found: dict[tuple[str, int, str | None], KnownSentence] = {}
    for item in known_sentences(mode_id):
        key = (item.kind, item.step, item.about)
        before = found.get(key)
        if before is not None:
            item = replace(
                before, text=f"{before.text} {item.text}", terms=before.terms | item.terms
            )
        found[key] = item
    return tuple(found.values())


@cache
def quotes(cylinder: int | None) -> dict[str, tuple[KnownSentence, ...]]:
    """Every sentence of every mode by its `normal` text, with ``cylinder`` named where known."""
    found: dict[str, list[KnownSentence]] = {}
    for mode_id in knowledge():
        for item in known_sentences(mode_id):
            for text in {item.text, with_cylinder(item.text, cylinder)}:
                found.setdefault(normal(text), []).append(item)
    return {text: tuple(items) for text, items in found.items()}


@cache
def vocabulary(mode_id: str) -> frozenset[str]:
    """The stems of all that is known of a mode, its look-alikes' names included."""
    mode = knowledge()[mode_id]
    names = " ".join([mode.name, *(knowledge()[item.mode].name for item in mode.look_alikes)])
    parts: set[str] = set(stems(names))
    for item in known_sentences(mode_id):
        parts |= set(stems(item.text))
    return frozenset(parts)


@cache
def known_quantities(mode_id: str) -> tuple[Quantity, ...]:
    """Every number in the knowledge of a mode, with the ranges of its channels and its shares."""
    mode = knowledge()[mode_id]
    texts = [item.text for item in known_sentences(mode_id)]
    texts += [with_cylinder(text, cylinder) for text in texts for cylinder in CYLINDERS]
    shares = [f"{100.0 * share:.0f} %" for share in mode.cylinder_share]
    return tuple(item for text in [*texts, *shares] for item in quantities(text, ()))
