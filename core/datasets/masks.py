"""Masks: photos in black and white, whose black takes pixels out of training and measuring.

COLMAP's convention is `masks/` beside `images/`, with the photo's name and `.png` behind it (`0001.jpg.png`); the
photo's name with another suffix is found, too. nerfstudio names them in `mask_path`. Black is what is darker than half
of a mask's brightest pixel, so that masks of 0 and 1, and masks kept as JPEG, are understood.
"""

from __future__ import annotations

from pathlib import Path, PurePosixPath

import numpy as np

from core.datasets.lens import Lens
from core.datasets.scaled_lens import same_shape
from core.datasets.undistortion import seen_pixels
from core.errors import ImageSizeMismatch
from core.images import SUFFIXES, read_image

FOLDER = "masks"


def find_mask(folder: Path, photo: PurePosixPath) -> Path | None:
    """The mask of a photo (its path within the photos' folder), if `folder` has one."""
    names = [photo.with_name(photo.name + ".png"), *(photo.with_suffix(suffix) for suffix in SUFFIXES)]
    return next((folder / name for name in names if (folder / name).is_file()), None)


def read_mask(path: Path, name: str, lens: Lens, size_px: tuple[int, int]) -> np.ndarray:
    """[height, width] bool, the pixels that a mask takes out of the undistorted photo at a size (width, height).

    Conservative: a pixel is out when any part of it shows something black.

    Args:
        lens: of the photo as it is stored.
        name: the photo's, for messages.

    Raises:
        ImageUndecodable, ImageTooLarge, ImageSizeMismatch
    """
    brightness = read_image(path, name)[..., :3].max(-1)
    black = brightness < 0.5 * max(1, int(brightness.max()))
    height, width = black.shape
    if not same_shape((width, height), lens.size_px):
        raise ImageSizeMismatch(
            f"mask of photo {name}",
            "must have the photo's size, or its shape",
            f"{width} x {height} px for a photo of {lens.size_px[0]} x {lens.size_px[1]} px",
            "Make the mask from this photo, or remove it.",
        )
    return _covered(_undistorted(_covered(black, lens.size_px), lens), size_px)


def _undistorted(black: np.ndarray, lens: Lens) -> np.ndarray:
    if lens.distortion.is_none:
        return black
    return np.logical_or.reduce([black.ravel()[index] for index in seen_pixels(lens)])


def _covered(black: np.ndarray, size_px: tuple[int, int]) -> np.ndarray:
    """[height, width] bool at another size, true where a new pixel meets any true one."""
    for axis, count in enumerate(size_px[::-1]):
        edges = np.linspace(0, black.shape[axis], count + 1)
        first = np.minimum(np.floor(edges[:-1] + 1e-9).astype(int), black.shape[axis] - 1)
        last = np.maximum(np.ceil(edges[1:] - 1e-9).astype(int), first + 1)
        sums = np.cumsum(black, axis=axis, dtype=np.int64)
        sums = np.concatenate([np.zeros_like(sums.take([0], axis)), sums], axis)
        black = sums.take(last, axis) > sums.take(first, axis)
    return black
