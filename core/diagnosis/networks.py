"""The neural classifiers: each maps (batch, features, 150) windows to (batch, classes) logits.

The paper gives the convolutional network in full (section 5.1) and only names the other three.
Their sizes are ours: about as many multiplications a window as the paper's network or fewer. The
recurrent network and the transformer read the window in patches of five steps (1 s), which
shortens their sequence from 150 steps to 30.
"""

import math
from collections.abc import Callable

import torch
from torch import Tensor, nn

CNN_WIDTHS = (64, 128, 256)
CNN_KERNEL = 7
HIDDEN = 128
DROPOUT = 0.15

PATCH = 5
"""Steps of a patch: 1 s."""

LSTM_WIDTH = 128
LSTM_LAYERS = 2

RESNET_WIDTHS = (64, 128, 256)
RESNET_KERNELS = (7, 5, 3)

TRANSFORMER_WIDTH = 128
TRANSFORMER_HEADS = 4
TRANSFORMER_LAYERS = 3


def _head(width: int, n_classes: int) -> nn.Sequential:
    """The paper's two dense layers, shared by all."""
    return nn.Sequential(
        nn.Linear(width, HIDDEN), nn.ReLU(), nn.Dropout(DROPOUT), nn.Linear(HIDDEN, n_classes)
    )


class Cnn1d(nn.Module):
    """The paper's 1D-CNN (section 5.1): three convolutional blocks and two dense layers."""

    def __init__(self, n_features: int, n_classes: int) -> None:
        """Build it for ``n_features`` input channels; windows may have any length from 8 steps."""
        super().__init__()
        blocks: list[nn.Module] = []
        channels = n_features
        for width in CNN_WIDTHS:
            blocks += [
                nn.Conv1d(channels, width, CNN_KERNEL, padding=CNN_KERNEL // 2),
                nn.BatchNorm1d(width),
                nn.ReLU(),
                nn.MaxPool1d(2),
            ]
            channels = width
        self.body = nn.Sequential(*blocks, nn.AdaptiveAvgPool1d(1), nn.Flatten())
        self.head = _head(channels, n_classes)

    def forward(self, windows: Tensor) -> Tensor:
        """(batch, n_features, steps) -> (batch, n_classes) logits."""
        logits: Tensor = self.head(self.body(windows))
        return logits


class _Residual(nn.Module):
    """Three convolutions beside a shortcut; the first halves the length."""

    def __init__(self, channels: int, width: int) -> None:
        super().__init__()
        layers: list[nn.Module] = []
        from_width, stride = channels, 2
        for kernel in RESNET_KERNELS:
            layers += [
                nn.Conv1d(from_width, width, kernel, stride, kernel // 2, bias=False),
                nn.BatchNorm1d(width),
                nn.ReLU(),
            ]
            from_width, stride = width, 1
        self.path = nn.Sequential(*layers[:-1])
        self.shortcut = nn.Sequential(
            nn.Conv1d(channels, width, 1, 2, bias=False), nn.BatchNorm1d(width)
        )

    def forward(self, windows: Tensor) -> Tensor:
        return nn.functional.relu(self.path(windows) + self.shortcut(windows))


class ResNet1d(nn.Module):
    """Three residual blocks with kernels of 7, 5 and 3 (after Wang, Yan and Oates, 2017)."""

    def __init__(self, n_features: int, n_classes: int) -> None:
        """Build it for ``n_features`` input channels."""
        super().__init__()
        widths = (n_features, *RESNET_WIDTHS)
        blocks = [_Residual(*pair) for pair in zip(widths, RESNET_WIDTHS, strict=False)]
        self.body = nn.Sequential(*blocks, nn.AdaptiveAvgPool1d(1), nn.Flatten())
        self.head = _head(RESNET_WIDTHS[-1], n_classes)

    def forward(self, windows: Tensor) -> Tensor:
        """(batch, n_features, steps) -> (batch, n_classes) logits."""
        logits: Tensor = self.head(self.body(windows))
        return logits


class Lstm(nn.Module):
    """Two LSTM layers over patches; their mean output is classified."""

    def __init__(self, n_features: int, n_classes: int) -> None:
        """Build it for ``n_features`` input channels."""
        super().__init__()
        self.patches = nn.Conv1d(n_features, LSTM_WIDTH, PATCH, PATCH)
        self.lstm = nn.LSTM(LSTM_WIDTH, LSTM_WIDTH, LSTM_LAYERS, batch_first=True)
        self.head = _head(LSTM_WIDTH, n_classes)

    def forward(self, windows: Tensor) -> Tensor:
        """(batch, n_features, steps) -> (batch, n_classes) logits."""
        hidden, _ = self.lstm(self.patches(windows).transpose(1, 2))
        logits: Tensor = self.head(hidden.mean(dim=1))
        return logits


class Transformer(nn.Module):
    """A pre-norm transformer encoder over patches; their mean is classified."""

    def __init__(self, n_features: int, n_classes: int) -> None:
        """Build it for ``n_features`` input channels."""
        super().__init__()
        self.patches = nn.Conv1d(n_features, TRANSFORMER_WIDTH, PATCH, PATCH)
        layer = nn.TransformerEncoderLayer(
            TRANSFORMER_WIDTH, TRANSFORMER_HEADS, 2 * TRANSFORMER_WIDTH, DROPOUT,
            batch_first=True, norm_first=True,
        )  # fmt: skip
        self.encoder = nn.TransformerEncoder(
            layer, TRANSFORMER_LAYERS, nn.LayerNorm(TRANSFORMER_WIDTH), enable_nested_tensor=False
        )
        self.head = _head(TRANSFORMER_WIDTH, n_classes)

    def forward(self, windows: Tensor) -> Tensor:
        """(batch, n_features, steps) -> (batch, n_classes) logits."""
        tokens = self.patches(windows).transpose(1, 2)
        tokens = tokens + _positions(tokens.shape[1], tokens.shape[2]).to(tokens)
        logits: Tensor = self.head(self.encoder(tokens).mean(dim=1))
        return logits


def _positions(n: int, width: int) -> Tensor:
    """Sines and cosines that tell the n tokens apart, (n, width) (Vaswani et al., 2017)."""
    rates = torch.exp(torch.arange(0, width, 2) * (-math.log(10_000.0) / width))
    angles = torch.arange(n)[:, None] * rates
    return torch.stack([angles.sin(), angles.cos()], dim=-1).flatten(1)


NETWORKS: dict[str, Callable[[int, int], nn.Module]] = {
    "cnn": Cnn1d,
    "resnet": ResNet1d,
    "lstm": Lstm,
    "transformer": Transformer,
}
"""Each is built from the number of features and of classes."""
