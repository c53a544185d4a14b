"""Features 3 and 7 as the layout stores them, in alpha.

Phones test alpha before the shader runs, so the layout keeps it in the upper half: a = f // 2 + 128. Its viewers decode
2 a / 255 - 1, which is the feature byte f with its lowest bit set: 128 levels are left.
"""

import numpy as np

from core.conventions import is_opaque
from exporters.invalid import invalid

ALPHA_CHANNELS = (3, 7)


def as_stored(features_u8: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The two RGBA images [h, w, 4] of features [h, w, 8], uint8."""
    stored = features_u8.copy()
    stored[..., ALPHA_CHANNELS] = features_u8[..., ALPHA_CHANNELS] // 2 + 128
    return stored[..., :4], stored[..., 4:]


def as_shown(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Features [h, w, 8] of the two RGBA images, uint8, as the layout's viewers decode them; holes are zero.

    Raises:
        AssetInvalid: alpha is stored another way.
    """
    stored = np.concatenate([first, second], -1)
    opaque = is_opaque(stored)
    alpha = stored[..., ALPHA_CHANNELS]
    if (alpha[opaque] < 128).any():
        raise invalid("feature texture", "must hold f // 2 + 128 in alpha, as in the folders `*_phone`", "lower values")
    stored[..., ALPHA_CHANNELS] = 2 * (alpha - 128) + 1  # = 2 a - 255, without leaving uint8
    return np.where(opaque[..., None], stored, np.uint8(0))
