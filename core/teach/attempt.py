"""One learner's attempt at one mystery flight: all that may be told before it is over."""

from dataclasses import dataclass, replace
from datetime import UTC, datetime
from typing import Any, Self

from core.teach.challenge import Challenge
from core.teach.scoring import Mark, Score


@dataclass(frozen=True, slots=True)
class Attempt:
    """The learner's side of a mystery flight. The truth is not in here, but for ``run_id``.

    ``learner``: the browser that began it. ``begun`` and ``ended``: ISO 8601, UTC; ``ended`` is
    None while it is open. ``answer`` is the mode named, None also for giving up. ``run_id`` is the
    ordinary run that it becomes once it is over.
    """

    id: str
    learner: str
    challenge: Challenge
    begun: str
    marks: tuple[Mark, ...] = ()
    mirror_seen: bool = False
    answer: str | None = None
    ended: str | None = None
    score: Score | None = None
    run_id: str | None = None

    @property
    def over(self) -> bool:
        """Whether it has been answered or given up, so that the truth may be told."""
        return self.ended is not None

    @property
    def elapsed_s(self) -> float:
        """Seconds from its beginning to its end, or to now."""
        end = datetime.fromisoformat(self.ended) if self.ended else datetime.now(UTC)
        return (end - datetime.fromisoformat(self.begun)).total_seconds()

    def with_mark(self, mark: Mark) -> Self:
        """With a mark more; a channel has one, the last."""
        return replace(self.without_mark(mark.channel), marks=(*self._others(mark.channel), mark))

    def without_mark(self, channel: str) -> Self:
        """With no mark on that channel."""
        return replace(self, marks=self._others(channel))

    def _others(self, channel: str) -> tuple[Mark, ...]:
        return tuple(mark for mark in self.marks if mark.channel != channel)

    def to_dict(self) -> dict[str, Any]:
        """Plain JSON-ready values; `from_dict` reads them back."""
        return {
            "id": self.id,
            "learner": self.learner,
            "challenge": self.challenge.to_dict(),
            "begun": self.begun,
            "marks": [mark.to_dict() for mark in self.marks],
            "mirror_seen": self.mirror_seen,
            "answer": self.answer,
            "ended": self.ended,
            "score": self.score.to_dict() if self.score else None,
            "run_id": self.run_id,
        }

    @classmethod
    def from_dict(cls, values: dict[str, Any]) -> Self:
        """Read what `to_dict` wrote; raises `InputError` or ``KeyError`` for anything else."""
        return cls(
            **{
                **values,
                "challenge": Challenge.from_dict(values["challenge"]),
                "marks": tuple(Mark(**mark) for mark in values["marks"]),
                "score": Score.from_dict(values["score"]) if values["score"] else None,
            }
        )
