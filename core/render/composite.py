"""From rendered coverage to a picture."""

from collections.abc import Sequence

import numpy as np


def over(rgba: np.ndarray, background: Sequence[float]) -> np.ndarray:
    """A render [..., 4], premultiplied by coverage, over a background colour (sRGB, [0, 1]): [..., 3]."""
    return rgba[..., :3] + (1.0 - rgba[..., 3:]) * np.asarray(background, rgba.dtype)


def quantised(image: np.ndarray) -> np.ndarray:
    """uint8 of values in [0, 1], rounded, as a PNG stores them."""
    return np.rint(np.clip(image, 0.0, 1.0) * 255.0).astype(np.uint8)
