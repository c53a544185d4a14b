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
        origins, directions: [n * subrays, 3] in the scene's frame, a pixel's sub-rays together.
        centre_directions: [n, 3], through the pixels' centres, in the object frame: the network's.
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
        self.device, self._frame = device, frame
        self._cameras = frame.camera_array(cameras, device)
        self._pixels = torch.from_numpy(np.concatenate([image.reshape(-1, 4) for image in images])).to(device)
        self._starts = np.concatenate([[0], np.cumsum(sizes)])
        self._widths = np.array([camera.size_px[0] for camera in cameras])
        kept = [_kept(view.ignored, factor, image.shape[:2]) for view, image in zip(views, images, strict=True)]
        self._pool = _worth_drawing(images, kept, np.random.default_rng([seed, 1]))
        self._sub_offsets: Any = wp.array(SUBPIXEL_OFFSETS_PX.astype(np.float32), dtype=wp.vec2, device=device)
        self._no_offset: Any = wp.zeros(1, dtype=wp.vec2, device=device)

    def draw(self, rng: np.random.Generator, count: int, *, supersampled: bool) -> Batch:
        """`count` pixels: with four sub-rays each, or with one ray through each pixel's centre.

        (A ray somewhere within the pixel would learn the mean over the pixel at every place of it: blurred twice. On
        lego_400 that cost the voxel field 1.25 dB.)
        """
        index = self._pool[rng.integers(0, len(self._pool), count)]
        image = np.searchsorted(self._starts, index, side="right") - 1
        local = index - self._starts[image]
        point = np.stack([local % self._widths[image], local // self._widths[image]], -1) + 0.5
        images: Any = wp.array(image.astype(np.int32), dtype=wp.int32, device=self.device)
        points: Any = wp.array(point.astype(np.float32), dtype=wp.vec2, device=self.device)
        origins, directions = self._rays(images, points, self._sub_offsets if supersampled else self._no_offset)
        centres = self._rays(images, points, self._no_offset)[1] if supersampled else directions
        centres = self._frame.directions_to_object(centres)
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


def _kept(ignored: np.ndarray | None, factor: int, shape: tuple[int, int]) -> np.ndarray:
    """[h, w] bool: pixels of the smaller photo without an ignored pixel in them."""
    if ignored is None:
        return np.ones(shape, bool)
    mask = np.repeat(ignored[..., None].astype(np.uint8) * np.uint8(255), 3, 2)
    return downscaled(mask, factor)[..., 0] == 0


def _worth_drawing(images: Sequence[np.ndarray], kept: Sequence[np.ndarray], rng: np.random.Generator) -> np.ndarray:
    """Indices of the kept pixels on or near the object, and of a share of the others."""
    drawn = []
    for image, keep in zip(images, kept, strict=True):
        near = image[..., 3] > 0
        reach = max(1, round(NEAR_OBJECT * image.shape[1]))
        for axis in (0, 1):
            near = _dilated(near, reach, axis)
        drawn.append((keep & (near | (rng.random(near.shape) < BACKGROUND_SHARE))).ravel())
    return np.flatnonzero(np.concatenate(drawn))


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
    """Origins and directions [h * w, 3] through a camera's pixel centres, in the scene's frame."""
    directions = camera.directions(camera.pixel_centres()).reshape(-1, 3) @ frame.rotation
    origins = np.broadcast_to(frame.to_scene(camera.position), directions.shape)
    return (
        torch.from_numpy(origins.astype(np.float32)).contiguous().to(device),
        torch.from_numpy(directions.astype(np.float32)).contiguous().to(device),
    )
