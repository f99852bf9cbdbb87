"""A flight log as it was read: channels about once a second, and what there is to say of it."""

from dataclasses import dataclass, field

import numpy as np

from core.arrays import Array
from core.channels import CHANNEL_INDEX, CHANNEL_NAMES
from core.exchange.log_table import Dropped


@dataclass(frozen=True, slots=True)
class Conversion:
    """A column that was converted."""

    column: str
    from_unit: str
    to_unit: str


@dataclass(frozen=True, slots=True)
class Reading:
    """What was read of a log, beside its data.

    ``aircraft`` and ``device`` as its head names them. ``simulated``: a flight that our export or
    another simulator wrote. ``not_a_172``: what shows that the aircraft is none, where something
    does. ``doubts`` are sentences without their subject, the file.
    """

    rows: int = 0
    aircraft: str | None = None
    device: str | None = None
    simulated: bool = False
    not_a_172: str | None = None
    converted: tuple[Conversion, ...] = ()
    dropped: tuple[Dropped, ...] = ()
    doubts: tuple[str, ...] = ()

    def sentences(self) -> list[str]:
        """All of it for a person, a line each."""
        what = self.aircraft or (f"an aircraft with a {self.device}" if self.device else "unnamed")
        lines = [f"{self.rows} rows, aircraft: {what}"]
        lines += [f"{each.column} converted from {each.from_unit}" for each in self.converted]
        lines += [
            f"{each.rows} row{'s' * (each.rows > 1)} dropped ({each.reason})"
            for each in self.dropped
        ]
        return lines + list(self.doubts)


@dataclass(frozen=True, slots=True, eq=False)
class Log:
    """A flight as a log keeps it, about once a second; ours are kept in the same way.

    ``time_s``: (n,) seconds from its first row, rising. ``channels``: (n, 23) in
    `core.channels.CHANNELS` order and units, NaN where the log says nothing.
    """

    name: str
    time_s: Array
    channels: Array
    reading: Reading = field(default_factory=Reading)

    def __len__(self) -> int:
        """Number of rows, about one a second."""
        return len(self.time_s)

    def channel(self, name: str) -> Array:
        """One channel by its Garmin name, (n,)."""
        column: Array = self.channels[:, CHANNEL_INDEX[name]]
        return column

    @property
    def missing(self) -> tuple[str, ...]:
        """Channels that this log has no value of."""
        return tuple(name for name in CHANNEL_NAMES if np.isnan(self.channel(name)).all())
