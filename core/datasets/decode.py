"""Photos of a listing, decoded, undistorted and made smaller."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np

from core.capture import View
from core.datasets.listing import Listing, Photo
from core.datasets.undistortion import undistorted
from core.errors import ImageTooLarge
from core.images import area_resized, downscaled_size, read_image

# Pillow, zlib and NumPy release the GIL; each thread holds one photo in full size.
THREADS = 2

# All photos stay in memory while training: 4 GB of RGBA.
MAX_TOTAL_PIXELS = 1_000_000_000


def decoded(
    listing: Listing, *, max_size_px: int | None = None, downscale: float = 1
) -> tuple[tuple[View, ...], tuple[View, ...]]:
    """(train, test) views of a listing.

    Args:
        max_size_px: longest side at most, or None.
        downscale: sides are divided by it, >= 1. Of both limits the stricter one holds.

    Raises:
        ImageUndecodable, ImageTooLarge
    """
    sizes = [target_size(photo.camera.size_px, max_size_px, downscale) for photo in listing.photos]
    _check_total(sizes)
    with ThreadPoolExecutor(THREADS) as threads:
        futures = [threads.submit(_view, photo, size) for photo, size in zip(listing.photos, sizes, strict=True)]
        try:
            views = [future.result() for future in futures]
        except BaseException:
            threads.shutdown(cancel_futures=True)
            raise
    views = _without_idle_alpha(views)
    return tuple(views[: len(listing.train)]), tuple(views[len(listing.train) :])


def target_size(size_px: tuple[int, int], max_size_px: int | None, downscale: float) -> tuple[int, int]:
    """(width, height) after both limits."""
    factor = max(float(downscale), max(size_px) / max_size_px if max_size_px else 1.0)
    return downscaled_size(size_px, factor)


def _view(photo: Photo, size_px: tuple[int, int]) -> View:
    image = undistorted(read_image(photo.path, photo.name), photo.lens)
    return View(photo.camera.resized(size_px), area_resized(image, size_px))


def _without_idle_alpha(views: list[View]) -> list[View]:
    """An alpha channel that is opaque in every photo says nothing about what belongs to the object."""
    if any(not view.has_alpha or (view.image_u8[..., 3] < 255).any() for view in views):
        return views
    return [replace(view, image_u8=np.ascontiguousarray(view.image_u8[..., :3])) for view in views]


def _check_total(sizes: list[tuple[int, int]]) -> None:
    total = sum(width * height for width, height in sizes)
    if total > MAX_TOTAL_PIXELS:
        raise ImageTooLarge(
            "capture",
            f"all photos together may have {MAX_TOTAL_PIXELS // 1_000_000} megapixels",
            f"{total // 1_000_000} megapixels in {len(sizes)} photos",
            "Choose a smaller size for training, or leave photos out.",
        )
