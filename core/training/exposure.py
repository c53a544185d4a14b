"""Exposure differences between photos, evened where a capture has them.

Cameras on automatic expose every photo, and balance its white, anew. A colour is encoded nearly as a power of light, so
one factor in light is one factor in colour: each photo gets a gain for each channel, by which its true colours are
divided, and the scene keeps the photos' mean exposure. Held-out photos are measured as they are.

The gains come from the voxel field while it is still coarse: how bright each photo is against what is rendered of it.
Much of that is no exposure. The field does not yet know how the scene looks brighter from one side than from another,
and that changes smoothly from camera to camera; so only what no quadratic function of place and direction explains
counts. A smooth difference of exposure could not be told from the scene's shine, and costs nothing.

Measured (lego_100 with photos times 0.75 to 1.25, small settings; held-out photos as they were): 27.7 dB without
gains, 28.2 dB and SSIM 0.935 -> 0.945 with them; 28.5 dB without any difference. What lost:
- Dividing saturated channels, too: 28.0 dB.
- Gains on the rendered colours, trained by Adam along with the network: 28.1 dB, from the same start.
- Gains that begin with all of the difference, the smooth part included: 28.0 dB; and 0.4 dB below no gains on photos
  that do not differ. (As they are here: 0.02 dB, if the decision were wrong.)
- The spread of all of the difference as what decides: 2 to 6 % on photos that do not differ. Of the rest, which decides
  here, it is 0.4 % (fern), 1.4 % (fox), 2 % (lego_100), 3 % (the sample), and 14 % where the truth is 14.6 %.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import torch
from torch import Tensor

from core.camera import Camera

# Below this spread of the differences (root mean square of the logarithm) nothing is evened: it costs 0.1 dB at most.
LEAST_SPREAD = 0.05
# A photo is measured on pixels that the scene fills, in the photo and as rendered, if there are so many of them.
FILLED, LEAST_PIXELS = 0.5, 32
DARKEST = 1.0 / 255.0
# Photos for each coefficient of the smooth function; with fewer it is linear, or nothing is told.
PHOTOS_PER_TERM = 2


class BrightnessSurvey:
    """How bright photos are against what is rendered of them."""

    def __init__(self, photos: int, device: str) -> None:
        self._true, self._rendered = (torch.zeros(photos, 3, device=device, dtype=torch.float64) for _ in range(2))
        self._count = torch.zeros(photos, device=device, dtype=torch.int64)

    def add(self, color: Tensor, coverage: Tensor, true_color: Tensor, true_alpha: Tensor, image: Tensor) -> None:
        """Adds pixels: colours [n, 3] times coverage or alpha [n], of the photos `image` [n]."""
        filled = (coverage > FILLED) & (true_alpha > FILLED)
        image = image[filled]
        self._true.index_add_(0, image, true_color[filled].double())
        self._rendered.index_add_(0, image, color[filled].double())
        self._count.index_add_(0, image, torch.ones_like(image))

    def log_ratios(self) -> np.ndarray:
        """[photos, 3] float64: logarithm of true by rendered brightness; NaN for photos with too few pixels."""
        floor = DARKEST * self._count[:, None]
        ratios = torch.log(self._true.maximum(floor) / self._rendered.maximum(floor))
        ratios[self._count < LEAST_PIXELS] = torch.nan
        return ratios.cpu().numpy()


def exposure_differences(log_ratios: np.ndarray, cameras: Sequence[Camera]) -> np.ndarray:
    """[photos, 3]: what of the photos' logarithms of brightness [photos, 3] is their exposure.

    That is what no smooth function of the cameras' place and direction explains. The mean over the photos is 0. Photos
    that are not known (NaN) get 0, and so do all where they are too few to tell.
    """
    differences = np.zeros_like(log_ratios)
    known = np.isfinite(log_ratios).all(1)
    terms = _terms(np.array([camera.world_from_camera for camera in cameras])[known])
    if terms is not None:
        smooth = terms @ np.linalg.lstsq(terms, log_ratios[known], rcond=1e-6)[0]
        differences[known] = log_ratios[known] - smooth
    return differences


def spread_of(differences: np.ndarray) -> float:
    """Root mean square."""
    return float(np.sqrt(np.mean(differences**2)))


def evened(color: Tensor, log_gains: Tensor) -> Tensor:
    """Straight colours [n, 3] in [0, 1] as photos of mean exposure would have them.

    Args:
        log_gains: [n, 3], of each pixel's photo. Where it is above 0, a saturated channel stays as it is: how bright it
            was is not known.
    """
    saturated = (color >= 1.0) & (log_gains > 0.0)
    return torch.where(saturated, color, color * torch.exp(-log_gains))


def _terms(poses: np.ndarray) -> np.ndarray | None:
    """[photos, terms]: the values of 1, place and direction, and products of directions, for camera poses [n, 4, 4]."""
    place, direction = poses[:, :3, 3], -poses[:, :3, 2]
    linear = np.concatenate([np.ones((len(poses), 1)), place, direction], 1)
    pairs = [direction[:, i] * direction[:, j] for i in range(3) for j in range(i, 3)]
    for terms in (np.column_stack([linear, *pairs]), linear):
        if len(terms) >= PHOTOS_PER_TERM * terms.shape[1]:
            return terms
    return None
