"""Intrinsics of a photo, and the pinhole camera that its undistorted copy has."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from core.datasets.distortion import NO_DISTORTION, Distortion
from core.errors import PosesInvalid

BORDER_SAMPLES = 129
FOLD_SAMPLES = 65
# A pinhole photo of a wide lens grows without bound.
MAX_GROWTH = 4.0
# What a fisheye lens sees further out than 55 degrees (across or up) is cut off: a pinhole would spread it too thinly.
FISHEYE_REACH = float(np.tan(np.radians(55.0)))


@dataclass(frozen=True)
class Lens:
    """Intrinsics of a photo as it was taken: focal_px (fx, fy), centre_px (cx, cy), size_px (width, height)."""

    focal_px: tuple[float, float]
    centre_px: tuple[float, float]
    size_px: tuple[int, int]
    distortion: Distortion = NO_DISTORTION

    def normalised(self, pixels: np.ndarray) -> np.ndarray:
        return (pixels - self.centre_px) / self.focal_px

    def pixels(self, normalised: np.ndarray) -> np.ndarray:
        return normalised * self.focal_px + self.centre_px

    @property
    def pinhole(self) -> Lens:
        """The lens of the undistorted photo: the same focal length, cropped or grown to whole valid pixels.

        Raises:
            PosesInvalid: the distortion folds the photo over itself, or leaves nothing (or far too much) of it.
        """
        if self.distortion.is_none:
            return self
        left, top, right, bottom = inner_frame(self)
        centre_px = (self.centre_px[0] - left, self.centre_px[1] - top)
        return Lens(self.focal_px, centre_px, (right - left, bottom - top))


@lru_cache(maxsize=64)
def inner_frame(lens: Lens) -> tuple[int, int, int, int]:
    """(left, top, right, bottom) in pinhole pixels: the largest frame between the photo's four undistorted edges."""
    width, height = lens.size_px
    x, y = np.linspace(0.5, width - 0.5, BORDER_SAMPLES), np.linspace(0.5, height - 0.5, BORDER_SAMPLES)
    left_x, top_y = np.full_like(x, 0.5), np.full_like(y, 0.5)
    edges = [(left_x, y), (x, top_y), (left_x + (width - 1), y), (x, top_y + (height - 1))]
    with np.errstate(all="ignore"):
        points = np.stack([np.stack(edge, -1) for edge in edges])
        pinhole = lens.pixels(lens.distortion.undistort(lens.normalised(points)))
    if lens.distortion.fisheye:
        pinhole = _within_reach(lens, pinhole)
    if not np.isfinite(pinhole).all():
        raise _not_invertible(lens, "a photo edge that no straight ray reaches")
    bounds = [pinhole[0, :, 0].max(), pinhole[1, :, 1].max(), pinhole[2, :, 0].min(), pinhole[3, :, 1].min()]
    if np.abs(bounds).max() > 1e6:
        raise _not_invertible(lens, "photo edges more than a million pixels away")
    # The first and last pixel centres of the frame lie within the bounds.
    left, top = (int(np.ceil(bound - 0.5)) for bound in bounds[:2])
    right, bottom = (int(np.floor(bound + 0.5)) for bound in bounds[2:])
    if right <= left or bottom <= top:
        raise _not_invertible(lens, "nothing that all edges enclose")
    if (right - left) * (bottom - top) > MAX_GROWTH * width * height:
        raise _not_invertible(lens, f"a pinhole photo of {right - left} x {bottom - top} px")
    grid = np.stack(np.meshgrid(np.linspace(left, right, FOLD_SAMPLES), np.linspace(top, bottom, FOLD_SAMPLES)), -1)
    if (np.linalg.det(lens.distortion.jacobian(lens.normalised(grid))) <= 0).any():
        raise _not_invertible(lens, "a photo folded over itself")
    return left, top, right, bottom


def _within_reach(lens: Lens, edges: np.ndarray) -> np.ndarray:
    """Undistorted edges [left, top, right, bottom][samples][x, y], pulled in to what is kept of a fisheye photo.

    Parts of an edge that are 90 degrees and more off the axis have no pinhole point (NaN), and bound nothing.
    """
    low = lens.pixels(np.full(2, -FISHEYE_REACH))
    high = lens.pixels(np.full(2, FISHEYE_REACH))
    edges = edges.copy()
    for side, limit in enumerate((low, low, high, high)):
        across = side % 2
        values = np.where(np.isfinite(edges[side, :, across]), edges[side, :, across], limit[across])
        edges[side, :, across] = np.maximum(values, limit[across]) if side < 2 else np.minimum(values, limit[across])
        edges[side, :, 1 - across] = 0.0  # not a bound of this side
    return edges


def _not_invertible(lens: Lens, received: str) -> PosesInvalid:
    return PosesInvalid(
        "lens distortion",
        f"the coefficients {lens.distortion} must be invertible over the whole photo",
        received,
        "Calibrate again, undistort the photos beforehand, or set the coefficients to 0.",
    )
