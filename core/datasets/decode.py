"""Photos of a listing, decoded, undistorted and made smaller."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np

from core.capture import View
from core.datasets.listing import Listing, Photo
from core.datasets.masks import read_mask
from core.datasets.photo_folders import NO_REDUCTION, Reduction
from core.datasets.undistortion import undistorted
from core.errors import ImageTooLarge
from core.images import area_resized, downscaled_size, read_image

# Pillow, zlib and NumPy release the GIL; each thread holds one photo in full size.
THREADS = 2

# All photos stay in memory while training: 4 GB of RGBA.
MAX_TOTAL_PIXELS = 1_000_000_000


def decoded(listing: Listing, reduction: Reduction = NO_REDUCTION) -> tuple[tuple[View, ...], tuple[View, ...]]:
    """(train, test) views of a listing, in the frame of its poses.

    Raises:
        ImageUndecodable, ImageTooLarge, ImageSizeMismatch
    """
    sizes = [target_size(photo, reduction) for photo in listing.photos]
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


def target_size(photo: Photo, reduction: Reduction) -> tuple[int, int]:
    """(width, height) that a photo is reduced to; a copy that is small already counts as reduced."""
    size_px = photo.camera.size_px
    return downscaled_size(size_px, reduction.factor(size_px, photo.scale))


def _view(photo: Photo, size_px: tuple[int, int]) -> View:
    image = area_resized(undistorted(read_image(photo.path, photo.name), photo.lens), size_px)
    ignored = read_mask(photo.mask_path, photo.name, photo.lens, size_px) if photo.mask_path else None
    return View(photo.camera.resized(size_px), image, ignored, photo.depth_range)


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
