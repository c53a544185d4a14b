"""What the seed decides about the sample: colours, and the details of the still life."""

from __future__ import annotations

import colorsys
from dataclasses import dataclass

import numpy as np

# Palette entries, in the order the kernels expect them.
GLAZE_DARK, GLAZE_MID, CERAMIC, LIGHT_WOOD, DARK_WOOD, RED_WOOD, METAL, LEAF, PETAL, PETAL_HEART = range(10)

# (hue of the dark glaze, hue of the middle glaze, hue of the petals), in turns; they go with wood and copper.
SCHEMES = ((0.60, 0.55, 0.94), (0.47, 0.42, 0.92), (0.64, 0.50, 0.02), (0.53, 0.45, 0.97), (0.98, 0.06, 0.13))


@dataclass(frozen=True)
class Design:
    """A seed's choices.

    Attributes:
        palette: [10, 3] float64, linear reflectance.
        seed: of the procedural patterns.
        rays: points of the table's inlaid star.
        twigs: how many twigs the branch has.
        spout_rad: the teapot's heading.
    """

    palette: np.ndarray
    seed: int
    rays: int
    twigs: int
    spout_rad: float


def design_of(seed: int) -> Design:
    """The design of a seed; the same for the same seed, on every machine."""
    rng = np.random.default_rng(seed)
    dark, mid, petal = SCHEMES[seed % len(SCHEMES)]
    tone = rng.uniform(-0.012, 0.012)
    palette = [
        _linear(dark + tone, 0.85, 0.42),
        _linear(mid + tone, 0.70, 0.62),
        _linear(0.11, 0.10, 0.93),
        _linear(0.095, 0.42, 0.82),
        _linear(0.07, 0.62, 0.36),
        _linear(0.035, 0.62, 0.50),
        np.array([0.93, 0.38, 0.18]),  # copper's normal reflectance
        _linear(0.27 + tone, 0.62, 0.46),
        _linear(petal, 0.24, 0.99),
        _linear(petal, 0.72, 0.86),
    ]
    return Design(
        np.array(palette),
        seed,
        rays=int(rng.choice([16, 20, 24])),
        twigs=int(rng.integers(6, 9)),
        spout_rad=float(rng.uniform(-0.5, 0.5)),
    )


def _linear(hue: float, saturation: float, value: float) -> np.ndarray:
    srgb = np.array(colorsys.hsv_to_rgb(hue % 1.0, saturation, value))
    return np.where(srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4)
