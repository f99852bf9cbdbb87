"""What `realism` compares: a channel in cruise, and a pair of channels."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class ChannelRow:
    """A channel in cruise. None where there is nothing to compare with.

    ``mean_held``: our mean lies between the lowest and the highest real reading. ``noise_held``:
    our white noise is within a factor `NOISE_FACTOR` of the real one.
    """

    channel: str
    unit: str
    mean_ours: float | None
    mean_real: float | None
    low_real: float | None
    high_real: float | None
    mean_held: bool | None
    noise_ours: float | None
    noise_real: float | None
    noise_ratio: float | None
    noise_held: bool | None


@dataclass(frozen=True, slots=True)
class CorrelationRow:
    """A pair of channels, over ``span``: whole cruise, or within half a minute of steady cruise.

    ``held``: the sign is right and the difference at most `CORRELATION_WITHIN`.
    """

    channels: tuple[str, str]
    span: str
    ours: float | None
    real: float | None
    held: bool | None
