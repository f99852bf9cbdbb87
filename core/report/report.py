"""A diagnostic report: five sections (paper section 5.2), whoever wrote it."""

from dataclasses import asdict, dataclass
from typing import Any

SECTION_TITLES: tuple[str, ...] = (
    "Conclusion",
    "Mechanism",
    "Evidence cross-check",
    "Differential diagnosis",
    "Maintenance",
)


@dataclass(frozen=True, slots=True)
class Section:
    """One section: its title and its text in Markdown (no raw HTML)."""

    title: str
    markdown: str


@dataclass(frozen=True, slots=True)
class Report:
    """The whole report. ``writer`` says who wrote it: ``"template"``, or a model's name."""

    sections: tuple[Section, ...]
    writer: str

    @property
    def markdown(self) -> str:
        """The report as one Markdown text."""
        return "\n\n".join(f"## {part.title}\n\n{part.markdown}" for part in self.sections)

    def to_dict(self) -> dict[str, Any]:
        """Plain JSON-ready values; `from_dict` reads them back."""
        return asdict(self)

    @classmethod
    def from_dict(cls, values: dict[str, Any]) -> "Report":
        """Read what `to_dict` wrote."""
        return cls(tuple(Section(**part) for part in values["sections"]), values["writer"])
