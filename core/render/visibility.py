"""What each sample of an image sees of a scene: the half of rendering that both renderers share."""

from dataclasses import dataclass

import numpy as np

from core.baked import BakedScene
from core.camera import Camera
from core.conventions import FEATURE_CHANNELS, feature_from_byte

NOTHING = -1
SUBPIXELS_PER_SIDE = 2  # conventions.SUBPIXEL_OFFSETS_PX is the regular 2 x 2 grid


@dataclass(frozen=True)
class Visibility:
    """The nearest opaque texel at every sample of an image, samples being pixel centres.

    Attributes:
        page: int32 [h, w], NOTHING (-1) where no opaque texel is hit; the others are 0 there.
        triangle: int32 [h, w], index among the page's triangles; a quad is triangle // 2.
        row, column: int32 [h, w], texel of the page.
    """

    page: np.ndarray
    triangle: np.ndarray
    row: np.ndarray
    column: np.ndarray

    @property
    def hit(self) -> np.ndarray:
        """[h, w] bool: whether the sample sees anything."""
        return self.page != NOTHING

    def features(self, scene: BakedScene) -> np.ndarray:
        """[h, w, 8] float64 in [0, 1]: the texel's features, zero where nothing is seen."""
        features = np.zeros((*self.page.shape, FEATURE_CHANNELS))
        for index, page in enumerate(scene.pages):
            here = self.page == index
            features[here] = feature_from_byte(page.features_u8[self.row[here], self.column[here]])
        return features


def subpixel_camera(camera: Camera) -> Camera:
    """The same view with a pixel for every sub-pixel: its pixel centres are the sub-pixels' positions."""
    width, height = camera.size_px
    return camera.resized((width * SUBPIXELS_PER_SIDE, height * SUBPIXELS_PER_SIDE))


def pixel_means(samples: np.ndarray) -> np.ndarray:
    """[h, w, c]: the mean of each pixel's sub-pixels, of what a `subpixel_camera` sees [2 h, 2 w, c]."""
    height, width, channels = samples.shape
    side = SUBPIXELS_PER_SIDE
    means: np.ndarray = samples.reshape(height // side, side, width // side, side, channels).mean((1, 3))
    return means
