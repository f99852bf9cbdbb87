"""What a report still lacks, in the template's words: each section has its essentials."""

from collections.abc import Callable, Iterable, Sequence

from core.knowledge.lexicon import terms
from core.report.case.case import Case
from core.report.case.wording import label
from core.report.check.checker import CheckedSentence
from core.report.check.reading import COVERED
from core.report.check.sentences import plain_text
from core.report.template.conclusion import conclusion
from core.report.template.cross_check import cross_check
from core.report.template.differential import differential
from core.report.template.template import maintenance, mechanism


def supplement(case: Case, title: str, kept: Sequence[CheckedSentence]) -> str:
    """The template's lines that a section made of ``kept`` lacks, as Markdown; "" for none."""
    chosen: dict[str, Callable[[Case, Sequence[CheckedSentence]], Iterable[str]]] = {
        "Conclusion": _conclusion,
        "Mechanism": _steps,
        "Evidence cross-check": _rows,
        "Differential diagnosis": _rivals,
        "Maintenance": _actions,
    }
    return "\n".join(chosen[title](case, kept))


def _conclusion(case: Case, kept: Sequence[CheckedSentence]) -> list[str]:
    """Verdict, confidence and doubts: always, for they are what a reader acts on."""
    lines = conclusion(case).splitlines()
    if any(item.concludes for item in kept):
        return [line for line in lines if line.startswith("**Confidence")]
    return lines


def _steps(case: Case, kept: Sequence[CheckedSentence]) -> list[str]:
    """The causal steps that were not told."""
    told = {step for item in kept for step in item.steps}
    steps = [line for line in mechanism(case).splitlines() if line[:1].isdigit()]
    return [line for number, line in enumerate(steps, start=1) if number not in told]


def _rows(case: Case, kept: Sequence[CheckedSentence]) -> list[str]:
    """The evidence that was not cited, and what is missing or rightly quiet."""
    told = {name for item in kept for name in item.channels}
    names = {label(item.channel) for item in case.evidence if item.channel not in told}
    lines = cross_check(case).splitlines()
    rows = [line for line in lines if line.startswith("| ") and line.split(" | ")[0][2:] in names]
    return [*rows, *(line for line in lines if line.startswith("- **"))]


def _rivals(case: Case, kept: Sequence[CheckedSentence]) -> list[str]:
    """The candidates and look-alikes of which nothing was said."""
    said = " ".join(plain_text(item.text) for item in kept).casefold()
    lines: list[str] = []
    missing = False
    for line in differential(case).splitlines():
        if line.startswith("- **"):
            missing = line.removeprefix("- **").partition("**")[0].casefold() not in said
        if missing:
            lines.append(line)
    return lines


def _actions(case: Case, kept: Sequence[CheckedSentence]) -> list[str]:
    """The actions that were not told, and whose word comes first."""
    lines = maintenance(case).splitlines()
    return [line for line in lines if line and not (line[:1].isdigit() and _told(line, kept))]


def _told(line: str, kept: Sequence[CheckedSentence]) -> bool:
    telling = terms(line)
    said = frozenset[str]().union(*(terms(item.text) for item in kept))
    return len(telling & said) >= COVERED * len(telling)
