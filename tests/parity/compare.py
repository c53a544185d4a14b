"""How equal two renderings of a scene are, where binary opacity makes edges discontinuous.

Two correct rasterisers may disagree about which side of an edge a sample lies on. So pixels are split: a *flipped*
pixel differs visibly *and* has an edge (of a surface, or of the opacity mask) beneath it in the reference; all others
are the *interior*. The interior is held to a PSNR, the flipped ones to a share. Only pixels that show something in
either image count: an empty background would flatter both figures.
"""

from dataclasses import dataclass

import numpy as np

from core.baked import BakedScene
from core.camera import Camera
from core.render.reference import visibility
from core.render.visibility import Visibility, subpixel_camera

# What two renderers of a scene must reach. Rounding to 8 bits alone gives 59 to 60 dB. OpenGL snaps vertices to
# 1/256 px and computes in float32, so a few samples on edges fall on the other side.
INTERIOR_DB = 50.0
FLIPPED_SHARE = 0.005
# Of files that round features.
QUANTISED_DB = 45.0
QUANTISED_VISIBLE = 16 / 255  # ten deviations of what rounded features cost (44 dB); another texel differs by more

COVERAGE_STEP = 1 / 4  # one sub-pixel
SMALLEST_ERROR = 1e-12  # 120 dB: stands for "equal"
VISIBLE = 3 / 255  # more than rounding to 8 bits and float32 arithmetic explain


@dataclass(frozen=True)
class Comparison:
    """What `compare` found.

    Attributes:
        interior_psnr: dB over the shown pixels that are not flipped, of premultiplied RGBA in [0, 1].
        flipped_share: of the shown pixels, 0 to 1.
        flipped: [h, w] bool.
        difference: [h, w] float64, largest of the four channels.
    """

    interior_psnr: float
    flipped_share: float
    flipped: np.ndarray
    difference: np.ndarray

    def __str__(self) -> str:
        return f"interior {self.interior_psnr:.2f} dB, flipped {100 * self.flipped_share:.3f} %"


def compare(actual: np.ndarray, reference: np.ndarray, edges: np.ndarray, *, visible: float = VISIBLE) -> Comparison:
    """Two images [h, w, 4] (premultiplied, in [0, 1]) of which the reference has edges at `edges` ([h, w] bool).

    Args:
        visible: from which difference on a pixel on an edge counts as flipped; above the noise of what is lossy.
    """
    difference = np.abs(actual - reference).max(-1)
    coverage_differs = np.abs(actual[..., 3] - reference[..., 3]) > COVERAGE_STEP / 2
    flipped = edges & (coverage_differs | (difference > visible))
    shown = (actual[..., 3] > 0) | (reference[..., 3] > 0)
    squares = ((actual - reference) ** 2)[shown & ~flipped]
    psnr = -10 * np.log10(max(squares.mean(), SMALLEST_ERROR)) if squares.size else 0.0
    return Comparison(float(psnr), float(flipped.sum() / max(shown.sum(), 1)), flipped, difference)


def pixels_with_edges(scene: BakedScene, camera: Camera) -> np.ndarray:
    """[h, w] bool: pixels among whose sub-pixels, or next to them, the surface or the opacity changes."""
    edge = _grown(_sample_edges(visibility(scene, subpixel_camera(camera))))
    height, width = edge.shape
    return edge.reshape(height // 2, 2, width // 2, 2).any((1, 3))


def _sample_edges(seen: Visibility) -> np.ndarray:
    """[h, w] bool: samples that see another quad, or nothing, beside their right or lower neighbour; both marked."""
    surface = np.where(seen.hit, seen.page * np.int64(2**32) + seen.triangle // 2, -1)
    edge = np.zeros(surface.shape, bool)
    beside = surface[:, :-1] != surface[:, 1:]
    edge[:, :-1] |= beside
    edge[:, 1:] |= beside
    above = surface[:-1] != surface[1:]
    edge[:-1] |= above
    edge[1:] |= above
    return edge


def _grown(mask: np.ndarray) -> np.ndarray:
    """The mask and its eight neighbours."""
    padded = np.pad(mask, 1)
    height, width = mask.shape
    return np.any([padded[i : i + height, j : j + width] for i in range(3) for j in range(3)], 0)
