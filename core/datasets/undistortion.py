"""Photos freed of their lens distortion, by looking up where each pinhole pixel was seen."""

from collections.abc import Iterator
from functools import lru_cache

import numpy as np

from core.datasets.lens import Lens, inner_frame

STRIP_PIXELS = 1 << 18  # pixels in flight at a time; float32 copies of a whole large photo would not fit the cache


def undistorted(image_u8: np.ndarray, lens: Lens) -> np.ndarray:
    """The photo a pinhole would have taken: uint8, of `lens.pinhole.size_px`, bilinear in premultiplied colour.

    Args:
        image_u8: [height, width, 3 or 4] uint8, straight alpha, of `lens.size_px`.
    """
    if lens.distortion.is_none:
        return image_u8
    index, share_x, share_y = _lookup(lens)
    width, channels = lens.size_px[0], image_u8.shape[2]
    result = np.empty((*index.shape, channels), np.uint8)
    flat = image_u8.reshape(-1, channels)
    rows_per_strip = max(1, STRIP_PIXELS // index.shape[1])
    for first in range(0, len(index), rows_per_strip):
        rows = slice(first, first + rows_per_strip)
        at, tx, ty = index[rows], share_x[rows, :, None], share_y[rows, :, None]
        top = _mix(_taken(flat, at), _taken(flat, at + 1), tx)
        bottom = _mix(_taken(flat, at + width), _taken(flat, at + width + 1), tx)
        result[rows] = _straight_u8(_mix(top, bottom, ty))
    return result


def seen_pixels(lens: Lens) -> Iterator[np.ndarray]:
    """Four times [h, w] int32: flat indices of the photo's pixels that each pixel of the undistorted photo is mixed of.

    A pixel whose share is zero is replaced by another of the four.
    """
    index, share_x, share_y = _lookup(lens)
    width, height = lens.size_px
    right = np.minimum((share_x > 0).astype(np.int32), width - 1 - index % width)
    down = np.minimum((share_y > 0).astype(np.int32), height - 1 - index // width) * width
    yield index
    yield index + right
    yield index + down
    yield index + right + down


def forget_lookups() -> None:
    """Frees what is kept for further photos of the same lens: 12 bytes per pixel of up to two lenses."""
    _lookup.cache_clear()


@lru_cache(maxsize=2)  # as many as photos are read at once
def _lookup(lens: Lens) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Per pinhole pixel [h, w]: flat index (int32) of the upper left of four photo pixels, and the shares (float32)."""
    left, top, right, bottom = inner_frame(lens)
    width, height = lens.size_px
    x = np.arange(left, right) + 0.5
    index = np.empty((bottom - top, right - left), np.int32)
    share_x, share_y = np.empty(index.shape, np.float32), np.empty(index.shape, np.float32)
    for row in range(len(index)):
        points = np.stack([x, np.full_like(x, top + row + 0.5)], -1)
        seen = lens.pixels(lens.distortion.distort(lens.normalised(points))) - 0.5
        column = np.clip(np.floor(seen[:, 0]), 0, max(width - 2, 0))
        line = np.clip(np.floor(seen[:, 1]), 0, max(height - 2, 0))
        index[row] = line * width + column
        share_x[row], share_y[row] = np.clip(seen[:, 0] - column, 0, 1), np.clip(seen[:, 1] - line, 0, 1)
    return index, share_x, share_y


def _taken(flat_u8: np.ndarray, index: np.ndarray) -> np.ndarray:
    pixels = np.take(flat_u8, index, axis=0, mode="clip").astype(np.float32)  # "clip": photos one pixel wide or high
    if pixels.shape[-1] == 4:
        pixels[..., :3] *= pixels[..., 3:] * np.float32(1 / 255)
    return pixels


def _mix(a: np.ndarray, b: np.ndarray, share: np.ndarray) -> np.ndarray:
    b -= a
    b *= share
    b += a
    return b


def _straight_u8(premultiplied: np.ndarray) -> np.ndarray:
    if premultiplied.shape[-1] == 4:
        alpha = premultiplied[..., 3:]
        premultiplied[..., :3] *= 255.0 / np.maximum(alpha, 1e-3)
    return np.rint(np.clip(premultiplied, 0, 255)).astype(np.uint8)
