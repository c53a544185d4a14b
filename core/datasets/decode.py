"""Photos of a listing, decoded, undistorted and made smaller."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np

from core.capture import View
from core.datasets.budget import check_total, target_size
from core.datasets.listing import Listing, Photo
from core.datasets.masks import read_mask
from core.datasets.photo_folders import NO_REDUCTION, Reduction
from core.datasets.undistortion import forget_lookups, undistorted
from core.images import area_resized, read_image

# Pillow, zlib and NumPy release the GIL; each thread holds one photo in full size.
THREADS = 2


def decoded(listing: Listing, reduction: Reduction = NO_REDUCTION) -> tuple[tuple[View, ...], tuple[View, ...]]:
    """(train, test) views of a listing, in the frame of its poses.

    Raises:
        ImageUndecodable, ImageTooLarge, ImageSizeMismatch
    """
    check_total(listing, reduction)
    sizes = [target_size(photo, reduction) for photo in listing.photos]
    try:
        with ThreadPoolExecutor(THREADS) as threads:
            views = list(threads.map(_view, listing.photos, sizes))
    finally:
        forget_lookups()
    _remove_idle_alpha(views)
    return tuple(views[: len(listing.train)]), tuple(views[len(listing.train) :])


def _view(photo: Photo, size_px: tuple[int, int]) -> View:
    image = area_resized(undistorted(read_image(photo.path, photo.name), photo.lens), size_px)
    ignored = read_mask(photo.mask_path, photo.name, photo.lens, size_px) if photo.mask_path else None
    return View(photo.camera.resized(size_px), image, ignored, photo.depth_range)


def _remove_idle_alpha(views: list[View]) -> None:
    """An alpha channel that is opaque in every photo says nothing about what belongs to the object."""
    if any(not view.has_alpha or (view.image_u8[..., 3] < 255).any() for view in views):
        return
    for index, view in enumerate(views):  # one after the other, in place: both kinds of all would take twice the memory
        views[index] = replace(view, image_u8=np.ascontiguousarray(view.image_u8[..., :3]))
