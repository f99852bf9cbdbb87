"""What the residual of a whole flight shows: its onset and its evidence, by how it was formed."""

from typing import Protocol

from core.diagnosis.diagnosis import Evidence
from core.diagnosis.evidence import find_evidence, find_field_evidence, find_surrogate_evidence
from core.residual.paired import first_departure
from core.residual.readers import (
    FieldReader,
    KnownReader,
    MirrorReader,
    ResidualReader,
    SurrogateReader,
)
from core.residual.surrogate import Surrogate
from core.twin.trajectory import Pair


class Findings(Protocol):
    """The findings of one flight, made from its ``reader`` once all of it was read."""

    @property
    def reader(self) -> ResidualReader:
        """Where the residuals come from."""

    def onset(self, pair: Pair) -> float | None:
        """Estimated onset of the whole flight in seconds; None where it departs from nothing."""

    def evidence(self, pair: Pair, until_s: float | None) -> tuple[Evidence, ...]:
        """Evidence of the whole flight, as far as ``until_s``."""


class MirrorFindings:
    """Findings against an exact mirror: whatever differs is the fault."""

    def __init__(self, reader: MirrorReader) -> None:
        """Of the flight that ``reader`` reads."""
        self.reader = reader

    def onset(self, pair: Pair) -> float | None:
        """The first sample at which any channel leaves the mirror."""
        first = first_departure(pair.residual)
        return None if first is None else float(pair.faulted.time_s[first])

    def evidence(self, pair: Pair, until_s: float | None) -> tuple[Evidence, ...]:
        """The channels that left the mirror."""
        return find_evidence(pair, until_s)[0]


class FieldFindings:
    """Findings against a mirror that is only roughly this aircraft in this air."""

    def __init__(self, reader: FieldReader) -> None:
        """Of the flight that ``reader`` reads."""
        self.reader = reader

    def onset(self, pair: Pair) -> float | None:
        """Where the flight departs from what healthy ones do."""
        departure = self.reader.departure()
        return None if departure is None else departure.onset_s

    def evidence(self, pair: Pair, until_s: float | None) -> tuple[Evidence, ...]:
        """The channels that stray farther than those of healthy flights."""
        reader = self.reader
        return find_field_evidence(
            reader.formed(pair), reader.departure(), reader.healthy, reader.air, until_s
        )[0]


class SurrogateFindings:
    """Findings of the surrogate, which errs by itself."""

    def __init__(self, surrogate: Surrogate, reader: KnownReader | SurrogateReader) -> None:
        """Of the flight that ``reader`` reads."""
        self.reader = reader
        self._surrogate = surrogate

    def onset(self, pair: Pair) -> float | None:
        """Where a channel leaves the band of the surrogate's usual errors."""
        return self._found(pair, None)[1]

    def evidence(self, pair: Pair, until_s: float | None) -> tuple[Evidence, ...]:
        """The channels that left that band."""
        return self._found(pair, until_s)[0]

    def _found(
        self, pair: Pair, until_s: float | None
    ) -> tuple[tuple[Evidence, ...], float | None]:
        time_s = pair.faulted.time_s
        return find_surrogate_evidence(self.reader.whole(), time_s, self._surrogate, until_s)
