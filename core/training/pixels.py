"""Training pixels, with their rays and their true colours, in an order that spreads evenly."""

import math
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
from core.images import downscaled, downscaled_size
from core.kernels.camera_rays import camera_rays
from core.kernels.launch import launch
from core.training.exposure import evened

# Of the pixels far from the object, this share is kept: they only say that nothing is there.
BACKGROUND_SHARE = 0.1
# Pixels within this share of the image's width of the object count as near it.
NEAR_OBJECT = 0.02
BLOCK = 2  # pixels per side of what a supersampled batch is drawn in
# The pool is gone through in steps of about this share of its size, round and round. Such points lie more evenly than
# random ones (Weyl's sequence; Knuth, The Art of Computer Programming 3, 6.4, theorem S): every pixel has its turn once
# a round, and those of a batch are far from each other. docs/training.md says what that is worth.
GOLDEN_SHARE = (math.sqrt(5.0) - 1.0) / 2.0


@dataclass(frozen=True)
class Batch:
    """Pixels of a training step.

    Attributes:
        origins, directions: [n * subrays, 3] in the scene's frame, a pixel's sub-rays together.
        centre_directions: [n, 3], through the pixels' centres, in the object frame: the network's.
        color: [n, 3], true colour times alpha. alpha: [n].
        image: [n] int64, the training photo that each pixel is of.
    """

    origins: Tensor
    directions: Tensor
    centre_directions: Tensor
    color: Tensor
    alpha: Tensor
    image: Tensor


class PixelPool:
    """All training pixels at one resolution.

    A pixel takes 3 bytes, or 4 where photos have an alpha channel, and 4 more where not every pixel may be drawn.
    Photos are gone through one by one, so that little is needed besides.

    Attributes:
        log_gains: [photos, 3], logarithms of the photos' exposures, which their colours are freed of; None for none.
    """

    def __init__(self, views: Sequence[View], frame: Frame, device: str, factor: int = 1, seed: int = 0) -> None:
        """Args: factor: the photos are area-averaged by it first."""
        cameras = [view.camera.resized(downscaled_size(view.camera.size_px, factor)) for view in views]
        self.device, self._frame = device, frame
        self.log_gains: Tensor | None = None
        self._cameras = frame.camera_array(cameras, device)
        self._starts = np.concatenate([[0], np.cumsum([camera.size_px[0] * camera.size_px[1] for camera in cameras])])
        self._widths = np.array([camera.size_px[0] for camera in cameras])
        pixels = _side_by_side(views, factor, self._starts)
        rng = np.random.default_rng([seed, 1])
        self._pool = _worth_drawing(pixels, views, factor, self._starts, rng)
        self._stride, self._phase = _coprime(round(GOLDEN_SHARE * self.size), self.size), int(rng.integers(2**31))
        self._pixels = torch.from_numpy(pixels).to(device)
        self._sub_offsets: Any = wp.array(SUBPIXEL_OFFSETS_PX.astype(np.float32), dtype=wp.vec2, device=device)
        self._no_offset: Any = wp.zeros(1, dtype=wp.vec2, device=device)

    @property
    def size(self) -> int:
        """Number of pixels that may be drawn."""
        return int(self._starts[-1]) if self._pool is None else len(self._pool)

    def draw(self, number: int, count: int, *, supersampled: bool) -> Batch:
        """Batch `number` of `count` pixels each: in blocks of 2 x 2 with four sub-rays each, or single ones with one
        ray through their centre.

        Rays of a block meet the same cells and texels, which are then in the processor's cache: a step of the texel
        stage takes 30 % less time. (A single ray *somewhere* within its pixel would learn the pixel's mean at every
        place of it, blurred twice: on lego_400 that cost the voxel field 1.25 dB.)
        """
        image, x, y = self._blocks(number, count) if supersampled else self._singles(number, count)
        index = self._starts[image] + y * self._widths[image] + x
        point = np.stack([x, y], -1) + 0.5
        images: Any = wp.array(image.astype(np.int32), dtype=wp.int32, device=self.device)
        points: Any = wp.array(point.astype(np.float32), dtype=wp.vec2, device=self.device)
        origins, directions = self._rays(images, points, self._sub_offsets if supersampled else self._no_offset)
        centres = self._rays(images, points, self._no_offset)[1] if supersampled else directions
        centres = self._frame.directions_to_object(centres)
        values = self._pixels[torch.from_numpy(index).to(self.device)].float() / 255.0
        alpha = values[:, 3] if values.shape[1] == 4 else torch.ones_like(values[:, 0])
        photo = torch.from_numpy(image).to(self.device)
        color = values[:, :3] if self.log_gains is None else evened(values[:, :3], self.log_gains[photo])
        return Batch(origins, directions, centres, color * alpha[:, None], alpha, photo)

    def _singles(self, number: int, count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """(photo, column, row) [count] of pixels of the pool."""
        first = (self._phase + number * count * self._stride) % self.size  # whole numbers of any length
        index = (first + np.arange(count) * self._stride) % self.size
        if self._pool is not None:
            index = self._pool[index].astype(np.int64)
        image = np.searchsorted(self._starts, index, side="right") - 1
        row, column = np.divmod(index - self._starts[image], self._widths[image])
        return image, column, row

    def _blocks(self, number: int, count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """As `_singles`, but in blocks around pixels of the pool. What does not belong to the pool, or lies outside of
        the photo, is drawn as the pixel that the block is around."""
        image, column, row = (np.repeat(a, BLOCK**2) for a in self._singles(number, -(-count // BLOCK**2)))
        dy, dx = np.divmod(np.arange(len(image)) % BLOCK**2, BLOCK)
        x, y = column + dx - BLOCK // 2, row + dy - BLOCK // 2
        width, first = self._widths[image], self._starts[image]
        height = (self._starts[image + 1] - first) // width
        drawn = (x >= 0) & (y >= 0) & (x < width) & (y < height)
        if self._pool is not None:
            index = np.where(drawn, first + y * width + x, 0).astype(self._pool.dtype)  # or all of it is converted
            place = np.minimum(np.searchsorted(self._pool, index), len(self._pool) - 1)
            drawn &= self._pool[place] == index
        return image[:count], np.where(drawn, x, column)[:count], np.where(drawn, y, row)[:count]

    def _rays(self, images: Any, points: Any, offsets: Any) -> tuple[Tensor, Tensor]:
        n = len(images) * len(offsets)
        origins, directions = empty(n, 3, device=self.device), empty(n, 3, device=self.device)
        inputs = [self._cameras, images, points, offsets, as_vec3(origins), as_vec3(directions)]
        launch(camera_rays, len(images), inputs, self.device)
        return origins, directions


def _side_by_side(views: Sequence[View], factor: int, starts: np.ndarray) -> np.ndarray:
    """[n, 3] uint8, or [n, 4] where any photo has an alpha channel: all photos' pixels; photo i begins at starts[i]."""
    pixels = np.empty((starts[-1], 4 if any(view.has_alpha for view in views) else 3), np.uint8)
    for view, first, last in zip(views, starts[:-1], starts[1:], strict=True):
        image = downscaled(view.image_u8, factor)
        channels = image.shape[2]
        pixels[first:last, :channels] = image.reshape(-1, channels)
        pixels[first:last, channels:] = 255
    return pixels


def _worth_drawing(
    pixels: np.ndarray, views: Sequence[View], factor: int, starts: np.ndarray, rng: np.random.Generator
) -> np.ndarray | None:
    """Indices of the pixels that no mask takes out, on or near the object, and of a share of the others.

    None where those are all.
    """
    if not any(view.has_alpha or view.ignored is not None for view in views):
        return None
    # As long as all pixels together; what is never written takes no memory.
    pool = np.empty(len(pixels), np.uint32 if len(pixels) <= 1 << 32 else np.int64)
    count = 0
    for view, first, last in zip(views, starts[:-1], starts[1:], strict=True):
        width, height = downscaled_size(view.camera.size_px, factor)
        shape = height, width
        near = _near_object(pixels[first:last, 3].reshape(shape)) if view.has_alpha else np.ones(shape, bool)
        drawn = _kept(view.ignored, factor, shape) & (near | (rng.random(shape) < BACKGROUND_SHARE))
        found = np.flatnonzero(drawn)
        pool[count : count + len(found)] = found + first
        count += len(found)
    return pool[:count]


def _coprime(stride: int, size: int) -> int:
    """The least number from `stride` on that shares no divisor with `size`: its multiples meet every index."""
    while math.gcd(stride, size) > 1:
        stride += 1
    return stride


def _near_object(alpha_u8: np.ndarray) -> np.ndarray:
    """[h, w] bool: pixels on or near the object."""
    near = alpha_u8 > 0
    reach = max(1, round(NEAR_OBJECT * alpha_u8.shape[1]))
    for axis in (0, 1):
        near = _dilated(near, reach, axis)
    return near


def _kept(ignored: np.ndarray | None, factor: int, shape: tuple[int, int]) -> np.ndarray:
    """[h, w] bool: pixels of the smaller photo without an ignored pixel in them."""
    if ignored is None:
        return np.ones(shape, bool)
    mask = np.repeat(ignored[..., None].astype(np.uint8) * np.uint8(255), 3, 2)
    return downscaled(mask, factor)[..., 0] == 0


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
