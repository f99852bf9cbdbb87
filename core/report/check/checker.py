"""The checker of free text: each sentence is compared with the evidence and the knowledge base.

A sentence is supported if all that it claims can be traced, contradicted if something in it is
false, unsupported if something in it has no source, and plain if it claims nothing. What is
checked: channels (logged? moved? which way? how far? when?), modes (a candidate? with that
probability?), cylinders, numbers, and every word that is not a plain one: it has to occur in the
knowledge of the modes that the sentence is about, so an invented part has no place to hide.
"""

import re
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from typing import Any, Literal

from core.knowledge.lexicon import lexicon, terms
from core.report.case.case import Case
from core.report.check.channel_checks import check_channels, check_times
from core.report.check.claims import channel_claims
from core.report.check.known import KnownSentence, normal, quotes
from core.report.check.mentions import (
    channel_mentions,
    cylinder_mentions,
    mode_mentions,
    quantities,
    time_mentions,
)
from core.report.check.reading import Checked, Reading
from core.report.check.trace_checks import check_numbers, check_terms
from core.report.check.verdict_checks import check_cylinders, check_modes
from core.report.sections import ANSWER, Section
from core.report.sentences import LineKind, Sentence
from core.report.statement import Run, StatementKind, inline

Verdict = Literal["supported", "unsupported", "contradicted", "plain"]

MAX_FRAME_CHARS = 60
"""The longest introduction before a quote."""

_DIGIT = re.compile(r"\d")


@dataclass(frozen=True, slots=True)
class CheckedSentence:
    """A sentence with its verdict, why, and what it cites.

    ``text``: as written, in Markdown; ``runs`` the same by its styles, and ``cells`` that of a row
    of the template's table. ``states``: what it is. ``channels``: cited, in order of mention;
    ``start_s``, ``end_s``: when they were away from their mirror, None where nothing measured is
    cited. ``about_sensors``: the number of claims about sensors, and ``sensors_right`` how many of
    them hold. ``steps``: causal steps of the verdict that it states, counted from 1.
    ``concludes``: whether it states the verdict of the diagnosis.
    """

    text: str
    section: str
    kind: LineKind
    marker: str
    indent: int
    first: bool
    verdict: Verdict
    reasons: tuple[str, ...]
    channels: tuple[str, ...]
    start_s: float | None
    end_s: float | None
    about_sensors: int
    sensors_right: int
    about_verdict: int
    verdict_right: int
    steps: tuple[int, ...]
    concludes: bool
    states: StatementKind = "text"
    runs: tuple[Run, ...] = ()
    cells: tuple[str, ...] = ()

    @property
    def struck(self) -> bool:
        """Whether a grounded report may not keep it."""
        return self.verdict in ("unsupported", "contradicted")

    @property
    def plain(self) -> str:
        """The text without any markup."""
        return " ".join(self.cells) if self.cells else "".join(run.text for run in self.runs)

    def to_dict(self) -> dict[str, Any]:
        """Plain JSON-ready values; ``runs`` is left out where the text has one style."""
        values = asdict(self)
        if self.runs == inline(self.text):
            del values["runs"]
        return values

    @classmethod
    def from_dict(cls, values: dict[str, Any]) -> "CheckedSentence":
        """Read what `to_dict` wrote, also after a way through JSON."""
        given: Any = {name: tuple(v) if isinstance(v, list) else v for name, v in values.items()}
        runs = values.get("runs")
        given["runs"] = (
            inline(values["text"]) if runs is None else tuple(Run(**run) for run in runs)
        )
        return cls(**given)


class Checker:
    """Checks the sentences of one report in their order.

    The order matters: what "it" is, and which mode a bullet of the differential speaks of, come
    from the sentences before.
    """

    def __init__(self, case: Case) -> None:
        """Check against the facts of ``case``."""
        self.case = case
        self._section = ANSWER
        self._subject = case.top.mode.id

    def check(self, sentence: Sentence, section: Section) -> CheckedSentence:
        """The verdict on the next sentence, in ``section``."""
        if section != self._section:
            self._section, self._subject = section, self.case.top.mode.id
        if sentence.kind == "heading":
            return self._result(sentence, section, [], None)
        text = sentence.plain
        quoted = self._quoted(text, section)
        channels = channel_mentions(text)
        cylinders = cylinder_mentions(text, channels)
        modes = mode_mentions(text)
        self._note_subject(sentence, [item.mode for item in modes])
        reading = Reading(
            case=self.case,
            text=text,
            section=section,
            kind=sentence.kind,
            subject=self._subject,
            channels=channels,
            cylinders=cylinders,
            modes=modes,
            quantities=quantities(text, [*channels, *cylinders]),
            times=time_mentions(text),
            is_action=self._is_action(text, section),
        )
        if quoted is not None:
            return self._result(sentence, section, [quoted], reading)
        claims = channel_claims(text, channels, reading.quantities, reading.times)
        found: list[Checked] = [
            *check_channels(reading, claims),
            *check_modes(reading),
            *check_cylinders(reading),
            *check_times(reading),
            *check_numbers(reading, claims),
        ]
        found += check_terms(reading, traced=bool(found))
        return self._result(sentence, section, found, reading)

    def _note_subject(self, sentence: Sentence, named: Sequence[str]) -> None:
        """Note the mode that the next sentences are about: that of the bullet they stand in."""
        if self._section.quotable == "any" and sentence.first and sentence.indent == 0:
            known = [mode for mode in named if mode in self.case.weighed]
            if known:
                self._subject = known[0]

    def _is_action(self, text: str, section: Section) -> bool:
        words = text.split(" ", 1)
        begins = bool(words and lexicon().action.fullmatch(words[0].strip(",.:;")))
        return section.quotable == "work order" or begins

    def _quoted(self, text: str, section: Section) -> Checked | None:
        """The check of a sentence that quotes the knowledge base word for word; None for others."""
        known = quotes(self.case.hit.cylinder if self.case.hit else None)
        whole = normal(text)
        items = known.get(whole) or known.get(_unframed(whole), ())
        if not items:
            return None
        allowed = self._quotable(section)
        right = [item for item in items if item.mode in allowed]
        if not right:
            owner = items[0]
            return Checked(
                False, "knowledge", f"said of {owner.mode}, which is not what this is about"
            )
        item = right[0]
        return Checked(True, "knowledge", f"knowledge of {item.mode}, {_place(item)}", quote=item)

    def _quotable(self, section: Section) -> set[str]:
        case = self.case
        match section.quotable:
            case "work order":
                return {item.mode.id for item in case.work_order}
            case "verdict":
                return {item.mode.id for item in case.open_verdicts}
            case "any":
                return set(case.weighed)

    def _result(
        self,
        sentence: Sentence,
        section: Section,
        found: Sequence[Checked],
        reading: Reading | None,
    ) -> CheckedSentence:
        sensors = [item for item in found if item.kind == "sensor"]
        verdicts = [item for item in found if item.kind == "verdict"]
        cited = list(dict.fromkeys(name for item in found for name in item.channels))
        if not cited and reading is not None:
            cited = _cited(self.case, found, reading)
        start_s, end_s = interval_of(self.case, cited)
        return CheckedSentence(
            text=sentence.text,
            section=section.title,
            kind=sentence.kind,
            marker=sentence.marker,
            indent=sentence.indent,
            first=sentence.first,
            verdict=_verdict(found),
            reasons=tuple(dict.fromkeys(item.reason for item in _telling(found))),
            channels=tuple(cited),
            start_s=start_s,
            end_s=end_s,
            about_sensors=len(sensors),
            sensors_right=sum(item.holds for item in sensors),
            about_verdict=len(verdicts),
            verdict_right=sum(item.holds for item in verdicts),
            steps=_steps(self.case, found, reading),
            concludes=any(item.concludes and item.holds for item in found),
            runs=inline(sentence.text),
        )


def _unframed(text: str) -> str:
    """A text without the plain words that introduce what follows: "according to ..., the crack"."""
    for mark in (", ", ": "):
        lead, found, rest = text.partition(mark)
        if found and len(lead) <= MAX_FRAME_CHARS and not terms(lead) and not _DIGIT.search(lead):
            return rest
    return text


def _verdict(found: Sequence[Checked]) -> Verdict:
    if any(item.kind_of_failure == "contradicted" for item in found):
        return "contradicted"
    if any(not item.holds for item in found):
        return "unsupported"
    return "supported" if found else "plain"


def _telling(found: Sequence[Checked]) -> list[Checked]:
    """The claims that decide the verdict: the failures, or else all that holds."""
    return [item for item in found if not item.holds] or list(found)


def _place(item: KnownSentence) -> str:
    return f"{item.kind} {item.step}" if item.step else item.kind


def _cited(case: Case, found: Sequence[Checked], reading: Reading) -> list[str]:
    """The channels that a sentence is about without naming them: those of the quoted step."""
    quote = next((item.quote for item in found if item.quote is not None), None)
    if quote is None or quote.kind != "chain" or quote.mode not in case.weighed:
        return list(dict.fromkeys(name for item in reading.channels for name in item.channels))
    finding = case.weighed[quote.mode].finding
    step = finding.chain[quote.step - 1]
    return [check.channel for check in step.checks if check.evidence is not None]


def interval_of(case: Case, names: Sequence[str]) -> tuple[float | None, float | None]:
    """When channels were away from their mirror; (None, None) where none of them was."""
    items = [item for item in case.evidence if item.channel in names]
    if not items:
        return None, None
    return min(item.start_s for item in items), max(item.end_s for item in items)


def _steps(case: Case, found: Sequence[Checked], reading: Reading | None) -> tuple[int, ...]:
    """The causal steps of the verdict that a sentence states, if nothing in it is false."""
    if reading is None or any(not item.holds for item in found):
        return ()
    return tuple(_stated(case, found, reading))


def _stated(case: Case, found: Sequence[Checked], reading: Reading) -> Iterator[int]:
    quoted = {item.quote.step for item in found if item.quote and item.quote.kind == "chain"}
    for number, step in enumerate(case.top.mode.chain, start=1):
        if number in quoted or reading.covers(step.text):
            yield number
