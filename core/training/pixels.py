"""Training pixels: drawn at random, with their rays and their true colours."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
import warp as wp
from torch import Tensor

from core.camera import Camera
from core.capture import View
from core.conventions import SUBPIXEL_OFFSETS_PX
from core.field.frame import Frame, as_vec3, empty
from core.images import downscaled
from core.kernels.camera_rays import camera_rays
from core.kernels.launch import launch

# Of the pixels far from the object, this share is kept: they only say that nothing is there.
BACKGROUND_SHARE = 0.1
# Pixels within this share of the image's width of the object count as near it.
NEAR_OBJECT = 0.02


@dataclass(frozen=True)
class Batch:
    """Pixels of a training step.

    Attributes:
        origins, directions: [n * subrays, 3] in the cube's frame, a pixel's sub-rays together.
        centre_directions: [n, 3], through the pixels' centres.
        color: [n, 3], true colour times alpha. alpha: [n].
    """

    origins: Tensor
    directions: Tensor
    centre_directions: Tensor
    color: Tensor
    alpha: Tensor


class PixelPool:
    """All training pixels at one resolution."""

    def __init__(self, views: Sequence[View], frame: Frame, device: str, factor: int = 1, seed: int = 0) -> None:
        """Args: factor: the photos are area-averaged by it first."""
        images = [_rgba(downscaled(view.image_u8, factor)) for view in views]
        cameras = [v.camera.resized((im.shape[1], im.shape[0])) for v, im in zip(views, images, strict=True)]
        sizes = [image.shape[0] * image.shape[1] for image in images]
        self.device = device
        self._cameras = frame.camera_array(cameras, device)
        self._pixels = torch.from_numpy(np.concatenate([image.reshape(-1, 4) for image in images])).to(device)
        self._starts = np.concatenate([[0], np.cumsum(sizes)])
        self._widths = np.array([camera.size_px[0] for camera in cameras])
        self._pool = _worth_drawing(images, np.random.default_rng([seed, 1]))
        self._sub_offsets: Any = wp.array(SUBPIXEL_OFFSETS_PX.astype(np.float32), dtype=wp.vec2, device=device)
        self._no_offset: Any = wp.zeros(1, dtype=wp.vec2, device=device)

    def draw(self, rng: np.random.Generator, count: int, *, supersampled: bool) -> Batch:
        """`count` pixels: with four sub-rays each, or with one ray somewhere within each pixel."""
        index = self._pool[rng.integers(0, len(self._pool), count)]
        image = np.searchsorted(self._starts, index, side="right") - 1
        local = index - self._starts[image]
        point = np.stack([local % self._widths[image], local // self._widths[image]], -1) + 0.5
        if not supersampled:
            point = point + rng.random((count, 2)) - 0.5
        images: Any = wp.array(image.astype(np.int32), dtype=wp.int32, device=self.device)
        points: Any = wp.array(point.astype(np.float32), dtype=wp.vec2, device=self.device)
        origins, directions = self._rays(images, points, self._sub_offsets if supersampled else self._no_offset)
        centres = self._rays(images, points, self._no_offset)[1] if supersampled else directions
        rgba = self._pixels[torch.from_numpy(index).to(self.device)].float() / 255.0
        alpha = rgba[:, 3]
        return Batch(origins, directions, centres, rgba[:, :3] * alpha[:, None], alpha)

    def _rays(self, images: Any, points: Any, offsets: Any) -> tuple[Tensor, Tensor]:
        n = len(images) * len(offsets)
        origins, directions = empty(n, 3, device=self.device), empty(n, 3, device=self.device)
        inputs = [self._cameras, images, points, offsets, as_vec3(origins), as_vec3(directions)]
        launch(camera_rays, len(images), inputs, self.device)
        return origins, directions


def _rgba(image_u8: np.ndarray) -> np.ndarray:
    if image_u8.shape[2] == 4:
        return image_u8
    return np.concatenate([image_u8, np.full_like(image_u8[..., :1], 255)], -1)


def _worth_drawing(images: Sequence[np.ndarray], rng: np.random.Generator) -> np.ndarray:
    """Indices of pixels on or near the object, and a share of the others."""
    kept = []
    for image in images:
        near = image[..., 3] > 0
        reach = max(1, round(NEAR_OBJECT * image.shape[1]))
        for axis in (0, 1):
            near = _dilated(near, reach, axis)
        kept.append((near | (rng.random(near.shape) < BACKGROUND_SHARE)).ravel())
    return np.flatnonzero(np.concatenate(kept))


def _dilated(mask: np.ndarray, reach: int, axis: int) -> np.ndarray:
    """True wherever the mask is true within `reach` along an axis (by running counts)."""
    padding = [(0, 0), (0, 0)]
    padding[axis] = (reach + 1, reach)
    counts = np.cumsum(np.pad(mask, padding).astype(np.int32), axis)
    n = mask.shape[axis]
    upper = np.take(counts, np.arange(2 * reach + 1, 2 * reach + 1 + n), axis)
    lower = np.take(counts, np.arange(0, n), axis)
    return upper > lower


def camera_rays_of(camera: Camera, frame: Frame, device: str) -> tuple[Tensor, Tensor]:
    """Origins and directions [h * w, 3] through a camera's pixel centres, in the cube's frame."""
    directions = camera.directions(camera.pixel_centres()).reshape(-1, 3)
    origins = np.broadcast_to(frame.to_cube(camera.position), directions.shape)
    return (
        torch.from_numpy(origins.astype(np.float32)).contiguous().to(device),
        torch.from_numpy(directions.astype(np.float32)).contiguous().to(device),
    )
