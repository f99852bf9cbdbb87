"""The surrogate residual, observed minus predicted, in a fast and in a streaming form.

Paper section 4.2: the residual is divided by its standard deviation on healthy flights, which is
never less than 1 % of the sensor's range; its mean before the fault is taken away; a sliding mean
smooths it.

A network that carried its state for ever could only be run sample after sample. So its memory is
bounded by construction: every `CHUNK` samples (the stride of the windows) begin with a state that
has seen the `WARM` samples before them and nothing else. The fast form runs all chunks of a flight
as one batch; the streaming form carries two states, one in use and one warming up. Both give the
same residual for any flight, and so does any stretch of a flight that begins on the grid.
"""

import hashlib
import json
from dataclasses import dataclass
from typing import Self

import numpy as np
import torch
from torch import Tensor

from core.arrays import Array32
from core.channels import CHANNELS, N_CHANNELS
from core.model_card import Card, unreadable
from core.residual.controls import CONTROL_CENTRE, CONTROL_SCALE
from core.residual.gru import N_INPUTS, GruNetwork, no_state
from core.residual.window import STRIDE_STEPS, WINDOW_STEPS

CHUNK = STRIDE_STEPS
WARM = 125
SEGMENT = WARM + CHUNK

SMOOTH_STEPS = 50
"""The sliding mean reaches back over one second."""

FLOOR_SHARE = 0.01
"""The least standard deviation of a residual, as a share of the sensor's range."""

BASELINE_ROWS = slice(CHUNK + SMOOTH_STEPS, WINDOW_STEPS)
"""Where a recording is taken to be healthy: its first 30 s, once warm and smoothed."""

FULL_SCALE = np.array([channel.full_scale for channel in CHANNELS])

BATCH = 64
"""Chunks run at once: more would only take memory."""


@dataclass(frozen=True, slots=True, eq=False)
class Surrogate:
    """A trained network with what it needs to read a flight.

    ``fingerprint`` tells this one from any other. ``channel_mean`` and ``channel_sd``, (23,),
    bring readings to about one; ``residual_sd``, (23,), is the residual's standard deviation on
    healthy flights, before the floor, in channel units. ``usual``, (23,), is how far the finished
    residual of healthy flights strays, in divisors.
    """

    name: str
    conditions: str
    fingerprint: str
    network: GruNetwork
    channel_mean: Array32
    channel_sd: Array32
    residual_sd: Array32
    usual: Array32

    @classmethod
    def from_card(cls, card: Card, weights: dict[str, Tensor]) -> Self:
        """The surrogate that a card describes; `MirrorTwinError` if this version cannot read it."""
        try:
            network = GruNetwork(int(card["horizon"]))
            network.load_state_dict(weights)
            constants = {
                name: np.asarray(card["constants"][name], dtype=np.float32)
                for name in ("channel_mean", "channel_sd", "residual_sd", "usual")
            }
            identity = json.dumps([card["weights_sha256"], card["constants"]])
            return cls(
                name=card["name"],
                conditions=card["conditions"],
                fingerprint=hashlib.sha256(identity.encode()).hexdigest()[:12],
                network=network.eval(),
                **constants,
            )
        except (KeyError, TypeError, ValueError, RuntimeError) as error:
            raise unreadable(card, error) from None

    @property
    def divisor(self) -> Array32:
        """What residuals are divided by, (23,), in channel units: layers one and two."""
        return np.maximum(self.residual_sd, FLOOR_SHARE * FULL_SCALE).astype(np.float32)

    def inputs(self, channels: Array32, controls: Array32) -> Array32:
        """(n, 27) network inputs from (n, 23) readings and (n, 4) commands."""
        inputs = np.full((len(channels), N_INPUTS), np.nan, dtype=np.float32)
        inputs[:, :N_CHANNELS] = (channels - self.channel_mean) / self.channel_sd
        inputs[:, N_CHANNELS:] = (controls - CONTROL_CENTRE) / CONTROL_SCALE
        return inputs

    def error(self, channels: Array32, controls: Array32) -> Array32:
        """Observed minus predicted in channel units, (n, 23): fast, for a whole recording.

        The first `CHUNK` rows, for which the network is not warm yet, are 0.
        """
        inputs = torch.from_numpy(self.inputs(channels, controls))
        n_chunks = -(-len(inputs) // CHUNK)
        error = np.zeros((n_chunks * CHUNK, N_CHANNELS), dtype=np.float32)
        if n_chunks > 1:
            padded = torch.nn.functional.pad(inputs, (0, 0, 0, n_chunks * CHUNK - len(inputs)))
            # The reading at a row is predicted from those before it: segments end a row early.
            segments = padded[CHUNK - WARM - 1 : -1].unfold(0, SEGMENT, CHUNK).transpose(1, 2)
            with torch.inference_mode():
                predicted = torch.cat(
                    [
                        self.network.next_reading(batch, no_state(len(batch)))[0][:, WARM:]
                        for batch in segments.split(BATCH)
                    ]
                )
            departed = padded[CHUNK:, :N_CHANNELS] - predicted.reshape(-1, N_CHANNELS)
            error[CHUNK:] = departed.numpy() * self.channel_sd
        return error[: len(inputs)]

    def smoothed(self, channels: Array32, controls: Array32) -> Array32:
        """The normalised and smoothed residual of a recording, (n, 23), its baseline still in."""
        return sliding_mean(self.error(channels, controls) / self.divisor)

    def residual(self, channels: Array32, controls: Array32) -> Array32:
        """The finished residual of a recording, (n, 23), in divisors."""
        return debiased(self.smoothed(channels, controls))

    def stream(self) -> "SurrogateStream":
        """The residual of a flight as it goes on."""
        return SurrogateStream(self)


def debiased(smoothed: Array32) -> Array32:
    """The third layer: a recording's residual less its mean while healthy. Needs 30 s.

    Before the network is warm and the mean complete, the residual is 0: nothing is known yet.
    """
    mean = smoothed[BASELINE_ROWS].mean(axis=0, dtype=np.float64).astype(np.float32)
    residual: Array32 = smoothed - mean
    residual[: BASELINE_ROWS.start] = 0.0
    return residual


def sliding_mean(values: Array32) -> Array32:
    """Mean over the last `SMOOTH_STEPS` rows of (n, k); rows before the first count as 0."""
    total = np.cumsum(values, axis=0, dtype=np.float64)
    total[SMOOTH_STEPS:] -= total[:-SMOOTH_STEPS].copy()
    return (total / SMOOTH_STEPS).astype(np.float32)


class SurrogateStream:
    """Follows a flight from its first sample; blocks of any size give the same residual."""

    def __init__(self, surrogate: Surrogate) -> None:
        """Before the first sample."""
        self._surrogate = surrogate
        self._row = 0
        self._state = no_state(2)
        self._predicted = torch.zeros(N_CHANNELS)
        self._tail = np.zeros((SMOOTH_STEPS - 1, N_CHANNELS), dtype=np.float32)

    def push(self, channels: Array32, controls: Array32) -> Array32:
        """The normalised and smoothed residual of the next rows, (k, 23), its baseline still in."""
        inputs = torch.from_numpy(self._surrogate.inputs(channels, controls))
        departed = np.full((len(inputs), N_CHANNELS), np.nan, dtype=np.float32)
        done = 0
        while done < len(inputs):
            # Up to where a state is due to start or to take over: both lie a row before the chunk.
            into = (self._row + 1) % CHUNK
            edge = CHUNK - WARM if into < CHUNK - WARM else CHUNK
            block = inputs[done : done + edge - into]
            departed[done : done + len(block)] = self._advanced(block)
            done += len(block)
        return self._smoothed(departed * self._surrogate.channel_sd / self._surrogate.divisor)

    def _advanced(self, block: Tensor) -> Array32:
        """Observed minus predicted of a block that crosses no edge, in network units."""
        used, warming = self._state.split(1, dim=1)
        if (self._row + 1) % CHUNK == 0:
            used = warming
        elif (self._row + 1) % CHUNK == CHUNK - WARM:
            warming = no_state(1)
        with torch.inference_mode():
            predicted, self._state = self._surrogate.network.next_reading(
                block.expand(2, -1, -1), torch.cat([used, warming], dim=1)
            )
            expected = torch.cat([self._predicted[None], predicted[0, :-1]])
            departed = (block[:, :N_CHANNELS] - expected).numpy()
            self._row += len(block)
            self._predicted = predicted[0, -1]
        warm: Array32 = departed.copy()
        warm[: max(0, CHUNK - (self._row - len(block)))] = 0.0
        return warm

    def _smoothed(self, normalised: Array32) -> Array32:
        recent = np.concatenate([self._tail, normalised])
        self._tail = recent[len(recent) - (SMOOTH_STEPS - 1) :]
        smoothed = sliding_mean(recent)[SMOOTH_STEPS - 1 :]
        return smoothed
