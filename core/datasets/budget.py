"""How large photos are read where the user names no size, so that memory stays bounded for any number of them.

While a scene trains, each pixel of all photos takes 3 bytes in the capture and 3 in the pixel pool; with an alpha
channel 4 and 4, with masks 1 more, and 4 more in the pool where not every pixel may be drawn: 6 to 13 bytes, 1.2 to
2.6 GB for 200 megapixels. (Measured: 6.0 bytes without alpha.) Of 6 GiB that leaves 4 to the scene. Quality does not
need more: `high`, the longest preset, draws 50 million pixels for its texels.

Baking and measuring hold one photo at a time, at 300 to 400 bytes per pixel: 2 GB for a photo of 2400 px a side. A mesh
has about 1200 texels across (128 cells of 9), and photos of twice that show it all they can.
"""

from __future__ import annotations

import math
from dataclasses import replace

from core.datasets.listing import Listing, Photo
from core.datasets.photo_folders import Reduction
from core.errors import ImageTooLarge
from core.images import downscaled_size

PIXEL_BUDGET = 200_000_000
SIDE_BUDGET_PX = 2400
# What the user may ask for by a size of his own.
MAX_TOTAL_PIXELS = 1_000_000_000
BYTES_PER_PIXEL = 13
MEGA, GIGA = 1_000_000, 1e9
STEP = 0.01  # of the factor that is looked for, so that people can read it


def within_budget(listing: Listing, reduction: Reduction, pixel_budget: int = PIXEL_BUDGET) -> Reduction:
    """The reduction that is asked for, stronger where the budget demands it; a size that the user states is kept."""
    if reduction.max_size_px is not None:
        return reduction
    bounded = replace(reduction, max_size_px=SIDE_BUDGET_PX)
    if total_pixels(listing, bounded) <= pixel_budget:
        return bounded
    low, high = 0, math.ceil(max(max(photo.camera.size_px) * photo.scale for photo in listing.photos) / STEP)
    while high - low > 1:  # by bisection: the total falls with the factor
        middle = (low + high) // 2
        fits = total_pixels(listing, _at_least(bounded, middle * STEP)) <= pixel_budget
        low, high = (low, middle) if fits else (middle, high)
    return _at_least(bounded, high * STEP)


def target_size(photo: Photo, reduction: Reduction) -> tuple[int, int]:
    """(width, height) that a photo is reduced to; a copy that is small already counts as reduced."""
    size_px = photo.camera.size_px
    return downscaled_size(size_px, reduction.factor(size_px, photo.scale))


def total_pixels(listing: Listing, reduction: Reduction) -> int:
    """Of all photos, reduced."""
    return sum(width * height for width, height in (target_size(photo, reduction) for photo in listing.photos))


def check_total(listing: Listing, reduction: Reduction) -> None:
    """Raises ImageTooLarge for more than anybody may ask for."""
    total = total_pixels(listing, reduction)
    if total > MAX_TOTAL_PIXELS:
        raise ImageTooLarge(
            "capture",
            f"all photos together may have {MAX_TOTAL_PIXELS // MEGA:,} megapixels",
            f"{total // MEGA:,} megapixels in {len(listing.photos)} photos",
            "Choose a smaller max_size_px, or leave it out: the size then follows from the number of photos.",
        )


def budget_notes(
    asked: tuple[Listing, Reduction], read: tuple[Listing, Reduction], pixel_budget: int = PIXEL_BUDGET
) -> tuple[str, ...]:
    """A remark where photos are read smaller than asked for, or where what is asked for takes much memory."""
    (width, height), (full_width, full_height) = _largest(*read), _largest(*asked)
    total = total_pixels(*read)
    if (width, height) != (full_width, full_height):
        return (
            f"Photos are read at {width} x {height} px instead of {full_width} x {full_height}, so that they fit into "
            f"memory: unless a size is given, all together may have {pixel_budget / MEGA:g} megapixels, and each "
            f"{SIDE_BUDGET_PX} px a side. --max-size-px (API: max_size_px) sets another size.",
        )
    if total > pixel_budget:
        return (
            f"All photos together have {total // MEGA} megapixels and take up to {total * BYTES_PER_PIXEL / GIGA:.0f} "
            "GB of memory while training; a smaller max_size_px, or none, takes less.",
        )
    return ()


def _largest(listing: Listing, reduction: Reduction) -> tuple[int, int]:
    return max((target_size(photo, reduction) for photo in listing.photos), key=math.prod)


def _at_least(reduction: Reduction, downscale: float) -> Reduction:
    return replace(reduction, downscale=max(reduction.downscale, downscale))
