"""The CNN is the paper's, layer by layer."""

import torch
from torch import nn

from core.diagnosis.networks import NETWORKS


def test_cnn_is_that_of_section_5_1():
    network = NETWORKS["cnn"](46, 20)
    layers = [layer for layer in network.modules() if not list(layer.children())]
    block = [nn.Conv1d, nn.BatchNorm1d, nn.ReLU, nn.MaxPool1d]
    tail = [nn.AdaptiveAvgPool1d, nn.Flatten, nn.Linear, nn.ReLU, nn.Dropout, nn.Linear]
    assert [type(layer) for layer in layers] == 3 * block + tail
    convolutions = [layer for layer in layers if isinstance(layer, nn.Conv1d)]
    assert [layer.out_channels for layer in convolutions] == [64, 128, 256]
    assert all(layer.kernel_size == (7,) and layer.padding == (3,) for layer in convolutions)
    dense = [layer for layer in layers if isinstance(layer, nn.Linear)]
    assert [(layer.in_features, layer.out_features) for layer in dense] == [(256, 128), (128, 20)]
    assert [layer.p for layer in layers if isinstance(layer, nn.Dropout)] == [0.15]


def test_every_classifier_maps_windows_to_logits():
    for name, build in NETWORKS.items():
        assert build(46, 20)(torch.zeros(2, 46, 150)).shape == (2, 20), name
