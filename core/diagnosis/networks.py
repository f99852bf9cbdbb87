"""The classifiers: each maps (batch, 46, 1500) features to (batch, 20) logits."""

from collections.abc import Callable

from torch import Tensor, nn

CNN_WIDTHS = (64, 128, 256)
CNN_KERNEL = 7
CNN_HIDDEN = 128
CNN_DROPOUT = 0.15


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
        self.head = nn.Sequential(
            nn.Linear(channels, CNN_HIDDEN),
            nn.ReLU(),
            nn.Dropout(CNN_DROPOUT),
            nn.Linear(CNN_HIDDEN, n_classes),
        )

    def forward(self, windows: Tensor) -> Tensor:
        """(batch, n_features, steps) -> (batch, n_classes) logits."""
        logits: Tensor = self.head(self.body(windows))
        return logits


CLASSIFIERS: dict[str, Callable[[int, int], nn.Module]] = {"cnn": Cnn1d}
"""Networks by name: each is built from the number of features and of classes."""
