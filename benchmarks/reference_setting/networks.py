"""The three networks of eq. 3 to 5."""

import torch
from torch import Tensor, nn

from benchmarks.reference_setting.setting import OPACITY_BIAS, PaperSetting
from core.conventions import FEATURE_CHANNELS, NETWORK_HIDDEN, NETWORK_INPUTS, NETWORK_OUTPUTS

SKIP_AFTER = 4  # NeRF: the encoded position enters again after the fifth layer


def encoded(points: Tensor, frequencies: int) -> Tensor:
    """NeRF's positional encoding: points [n, 3] and the sines and cosines of 2^k times them, [n, 3 + 6 frequencies]."""
    angles = points[:, None, :] * 2.0 ** torch.arange(frequencies, device=points.device)[:, None]
    return torch.cat([points, angles.sin().flatten(1), angles.cos().flatten(1)], 1)


class RadianceNetwork(nn.Module):
    """NeRF's network: positions [n, 3] of the cube to outputs [n, outputs], before the sigmoid."""

    def __init__(self, setting: PaperSetting, outputs: int) -> None:
        super().__init__()
        self.frequencies = setting.frequencies
        inputs = 3 + 6 * setting.frequencies
        sizes = [inputs] + [setting.width] * setting.depth
        sizes = [size + (inputs if i == SKIP_AFTER + 1 else 0) for i, size in enumerate(sizes)]
        self.layers = nn.ModuleList(nn.Linear(sizes[i], setting.width) for i in range(setting.depth))
        self.head = nn.Linear(setting.width, outputs)

    def forward(self, points: Tensor) -> Tensor:
        code = encoded(points, self.frequencies)
        x = code
        for i, layer in enumerate(self.layers):
            x = torch.relu(layer(torch.cat([x, code], 1) if i == SKIP_AFTER + 1 else x))
        return self.head(x)


class PaperNetworks(nn.Module):
    """A, F and H."""

    def __init__(self, setting: PaperSetting, seed: int) -> None:
        super().__init__()
        with torch.random.fork_rng(devices=[]):
            torch.manual_seed(seed)
            self.A = RadianceNetwork(setting, 1)
            self.F = RadianceNetwork(setting, FEATURE_CHANNELS)
            self.H = nn.Sequential(
                nn.Linear(NETWORK_INPUTS, NETWORK_HIDDEN), nn.ReLU(),
                nn.Linear(NETWORK_HIDDEN, NETWORK_HIDDEN), nn.ReLU(),
                nn.Linear(NETWORK_HIDDEN, NETWORK_OUTPUTS),
            )  # fmt: skip

    def opacity(self, points: Tensor) -> Tensor:
        """alpha [n] in [0, 1] (eq. 3)."""
        return torch.sigmoid(self.A(points)[:, 0] + OPACITY_BIAS)

    def features(self, points: Tensor) -> Tensor:
        """f [n, 8] in [0, 1] (eq. 4)."""
        return torch.sigmoid(self.F(points))

    def color(self, features: Tensor, directions: Tensor) -> Tensor:
        """c [n, 3] in [0, 1] (eq. 5)."""
        return torch.sigmoid(self.H(torch.cat([features, directions], 1)))
