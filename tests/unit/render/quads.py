"""Scenes of a few quads whose images are known in closed form. The camera sits at the origin, looking along -z."""

from collections.abc import Sequence

import numpy as np

from core.baked import BakedScene, Page
from core.camera import Camera
from tests.scenes import random_network

TWO_TRIANGLES = np.array([[0, 1, 2], [0, 2, 3]])
WHOLE_PAGE = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])


def camera(size_px: tuple[int, int] = (8, 8), *, position: Sequence[float] = (0.0, 0.0, 0.0)) -> Camera:
    """90 degrees wide and high: at depth z the image spans -z..z."""
    pose = np.eye(4)
    pose[:3, 3] = position
    width, height = size_px
    return Camera("test", pose, (width / 2, height / 2), (width / 2, height / 2), size_px)


def facing_quad(depth: float, *, left=-1.0, right=1.0, bottom=-1.0, top=1.0) -> np.ndarray:
    """[4, 3]: top left, top right, bottom right, bottom left; edges given as shares of the half image."""
    x, y = np.array([left, right, right, left]), np.array([top, top, bottom, bottom])
    return np.stack([x * depth, y * depth, np.full(4, -depth)], -1)


def page_of(features_u8: np.ndarray, corners: Sequence[np.ndarray]) -> Page:
    """A page that every quad [4, 3] shows whole."""
    triangles = 4 * np.arange(len(corners))[:, None, None] + TWO_TRIANGLES
    return Page(
        features_u8,
        np.zeros((*features_u8.shape[:2], 3), np.uint8),
        np.concatenate(corners).astype(np.float32),
        np.tile(WHOLE_PAGE, (len(corners), 1)).astype(np.float32),
        triangles.reshape(-1, 3).astype(np.uint32),
    )


def scene_of(*pages: Page) -> BakedScene:
    return BakedScene(pages, random_network(np.random.default_rng(3)), (1.0, 1.0, 1.0), np.eye(4))


def plain(*values: int) -> np.ndarray:
    """[1, n, 8] uint8: n texels in a row, each with the same value in every channel (0: a hole)."""
    return np.repeat(np.array(values, np.uint8)[None, :, None], 8, -1)
