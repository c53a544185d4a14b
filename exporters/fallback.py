"""Colours for viewers that cannot run the network, of scenes that come without."""

import numpy as np

from core.baked import ShaderNetwork
from core.conventions import is_opaque

# From everywhere alike: who photographed such a scene from where is not known.
DIRECTIONS = np.concatenate([np.eye(3), -np.eye(3)]).astype(np.float32)
TEXELS_AT_ONCE = 1 << 15  # 2 MB a layer: stays in the cache


def mean_colors(network: ShaderNetwork, features_u8: np.ndarray) -> np.ndarray:
    """[h, w, 3] uint8, sRGB: each opaque texel's colour averaged over six directions; holes are zero.

    In float32, the direction-free part of the first layer evaluated once; `ShaderNetwork.__call__` is its oracle.
    """
    colors = np.zeros((*features_u8.shape[:2], 3), np.uint8)
    opaque = is_opaque(features_u8)
    texels = features_u8[opaque]
    shown = np.empty((len(texels), 3), np.uint8)
    for first in range(0, len(texels), TEXELS_AT_ONCE):
        part = slice(first, first + TEXELS_AT_ONCE)
        shown[part] = np.rint(255.0 * _mean_over_directions(network, texels[part].astype(np.float32) / 255.0))
    colors[opaque] = shown
    return colors


def _mean_over_directions(network: ShaderNetwork, features: np.ndarray) -> np.ndarray:
    (w0, w1, w2), (b0, b1, b2) = network.weights, network.biases
    of_features = features @ w0[:, :8].T + b0
    total = np.zeros((len(features), 3), np.float32)
    with np.errstate(over="ignore", invalid="ignore"):  # weights may be as large as float32 goes
        for direction in DIRECTIONS:
            x = np.maximum(of_features + w0[:, 8:] @ direction, 0.0)
            x = np.maximum(x @ w1.T + b1, 0.0)
            total += np.nan_to_num(0.5 * (1.0 + np.tanh(0.5 * (x @ w2.T + b2))))
    mean: np.ndarray = total / np.float32(len(DIRECTIONS))
    return mean
