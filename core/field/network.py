"""The deferred neural shader H (eq. 5) while it trains, and the anti-aliased pixel (eq. 17)."""

from collections.abc import Sequence

import numpy as np
import torch
from torch import Tensor, nn

from core.baked import ShaderNetwork
from core.conventions import NETWORK_HIDDEN, NETWORK_INPUTS, NETWORK_OUTPUTS

# Below this coverage a pixel's mean feature is no longer resolved in float32; it weighs nothing either.
MIN_COVERAGE = 1e-4


# The logit that features 0 and 1 start at: sigmoid(4) = 0.98 leaves room for highlights.
COLOR_LOGIT = 4.0


def new_network(seed: int) -> nn.Sequential:
    """An untrained 11-16-16-3 network; the sigmoid is left to `shade`.

    It starts by showing features 0..2 as red, green and blue; everything else is random. From an all-random start, hues
    that are rare in the photos stay grey for thousands of steps.
    """
    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(seed)
        first = nn.Linear(NETWORK_INPUTS, NETWORK_HIDDEN)
        second = nn.Linear(NETWORK_HIDDEN, NETWORK_HIDDEN)
        last = nn.Linear(NETWORK_HIDDEN, NETWORK_OUTPUTS)
    with torch.no_grad():
        for layer in (first, second):
            layer.weight[:NETWORK_OUTPUTS] = 0.0
            layer.weight[:NETWORK_OUTPUTS, :NETWORK_OUTPUTS].diagonal().fill_(1.0)
            layer.bias[:NETWORK_OUTPUTS] = 0.0
        last.weight[:, :NETWORK_OUTPUTS] = 0.0
        last.weight[:, :NETWORK_OUTPUTS].diagonal().fill_(2.0 * COLOR_LOGIT)
        last.bias.fill_(-COLOR_LOGIT)
    return nn.Sequential(first, nn.ReLU(), second, nn.ReLU(), last)


def shade(network: nn.Module, features: Tensor, coverage: Tensor, directions: Tensor) -> Tensor:
    """A pixel's colour times its coverage, [n, 3].

    Args:
        features: [n, 8], mean over the sub-pixels of coverage times feature.
        coverage: [n] in [0, 1], mean over the sub-pixels.
        directions: [n, 3], unit, through the pixel's centre.
    """
    covered = features / coverage.clamp_min(MIN_COVERAGE)[:, None]
    return torch.sigmoid(network(torch.cat([covered, directions], -1))) * coverage[:, None]


def baked_network(network: nn.Sequential) -> ShaderNetwork:
    """The network's numbers."""
    layers: Sequence[nn.Linear] = [layer for layer in network if isinstance(layer, nn.Linear)]
    weights = [layer.weight.detach().cpu().numpy().astype(np.float32) for layer in layers]
    biases = [layer.bias.detach().cpu().numpy().astype(np.float32) for layer in layers]
    return ShaderNetwork((weights[0], weights[1], weights[2]), (biases[0], biases[1], biases[2]))
