"""The paper's surrogate: two GRU layers of 256 and a dense head (section 4.2)."""

import torch
from torch import Tensor, nn

from core.channels import N_CHANNELS
from core.residual.controls import N_CONTROLS

HIDDEN = 256
LAYERS = 2
N_INPUTS = N_CHANNELS + N_CONTROLS


class GruNetwork(nn.Module):
    """Predicts the next ``horizon`` readings of all channels after each sample."""

    def __init__(self, horizon: int) -> None:
        """Build it untrained."""
        super().__init__()
        self.horizon = horizon
        self.gru = nn.GRU(N_INPUTS, HIDDEN, num_layers=LAYERS, batch_first=True)
        self.head = nn.Linear(HIDDEN, horizon * N_CHANNELS)

    def forward(self, inputs: Tensor) -> Tensor:
        """(batch, n, 27) inputs -> (batch, n, horizon, 23): the readings 1 to horizon ahead."""
        hidden, _ = self.gru(inputs)
        ahead: Tensor = self.head(hidden).unflatten(-1, (self.horizon, N_CHANNELS))
        return ahead

    def next_reading(self, inputs: Tensor, state: Tensor) -> tuple[Tensor, Tensor]:
        """One step ahead only: (batch, n, 23) predictions and the state after the last sample.

        ``state``: (2, batch, 256), zeros at the start.
        """
        hidden, state = self.gru(inputs, state)
        first = self.head.weight[:N_CHANNELS], self.head.bias[:N_CHANNELS]
        predicted: Tensor = nn.functional.linear(hidden, *first)
        return predicted, state


def no_state(batch: int) -> Tensor:
    """The state of a network that has seen nothing, (2, batch, 256)."""
    return torch.zeros(LAYERS, batch, HIDDEN)
