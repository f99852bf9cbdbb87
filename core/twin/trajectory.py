"""What a flight leaves behind: states, effects and channels, sampled at 50 Hz."""

from dataclasses import dataclass

import numpy as np

from core.arrays import Array, Array32
from core.channels import CHANNEL_INDEX

STATE_NAMES: tuple[str, ...] = (
    "north_m", "east_m", "altitude_ft", "roll_deg", "pitch_deg", "heading_deg",
    "ias_kt", "vspd_fpm", "norm_ac_g", "alpha_deg", "qbar_psf",
    "rpm", "power_hp", "fuel_flow_gph", "map_inhg", "throttle", "oat_degc",
    "fuel_left_gal", "fuel_right_gal", "air_fuel_ratio",
)  # fmt: skip
"""What JSBSim gives, in the order of `Trajectory.states`; position is relative to the start."""

STATE_INDEX: dict[str, int] = {name: index for index, name in enumerate(STATE_NAMES)}

GROUND_FT = 0.0
"""The ground: sea level everywhere, for no terrain is simulated. A flight that meets it is over."""


@dataclass(frozen=True, slots=True, eq=False)
class Trajectory:
    """One flight, or a block of one.

    ``time_s``: (n,) seconds from the start of the recording. ``states``: (n, len(STATE_NAMES))
    float64. ``channels``: (n, 23) float32 in `core.channels.CHANNELS` order and units.
    """

    time_s: Array
    states: Array
    channels: Array32

    def __len__(self) -> int:
        """Number of samples."""
        return len(self.time_s)

    def state(self, name: str) -> Array:
        """One state by name, (n,)."""
        column: Array = self.states[:, STATE_INDEX[name]]
        return column

    def channel(self, name: str) -> Array32:
        """One channel by its Garmin name, (n,)."""
        column: Array32 = self.channels[:, CHANNEL_INDEX[name]]
        return column

    @property
    def ground_s(self) -> float | None:
        """When the aircraft met the ground; None if it did not."""
        below = self.state("altitude_ft") <= GROUND_FT
        return float(self.time_s[below.argmax()]) if below.any() else None

    def __getitem__(self, rows: slice) -> "Trajectory":
        """The samples in ``rows``."""
        return Trajectory(self.time_s[rows], self.states[rows], self.channels[rows])

    @staticmethod
    def joined(blocks: "list[Trajectory]") -> "Trajectory":
        """Consecutive blocks as one trajectory."""
        return Trajectory(
            np.concatenate([block.time_s for block in blocks]),
            np.concatenate([block.states for block in blocks]),
            np.concatenate([block.channels for block in blocks]),
        )


@dataclass(frozen=True, slots=True, eq=False)
class Pair:
    """The same flight with the fault and without it (paper section 3.3)."""

    faulted: Trajectory
    mirror: Trajectory

    @property
    def residual(self) -> Array32:
        """Paired residual, faulted - mirror, (n, 23) (paper section 4.1)."""
        difference: Array32 = self.faulted.channels - self.mirror.channels
        return difference

    @property
    def ground_s(self) -> float | None:
        """When the first of the two met the ground, which ends both; None if neither did."""
        met_s = [flight.ground_s for flight in (self.faulted, self.mirror)]
        return min((each_s for each_s in met_s if each_s is not None), default=None)

    def __getitem__(self, rows: slice) -> "Pair":
        """The samples in ``rows`` of both flights."""
        return Pair(self.faulted[rows], self.mirror[rows])

    @staticmethod
    def joined(blocks: "list[Pair]") -> "Pair":
        """Consecutive blocks as one pair."""
        if len(blocks) == 1:
            return blocks[0]
        return Pair(
            Trajectory.joined([block.faulted for block in blocks]),
            Trajectory.joined([block.mirror for block in blocks]),
        )
