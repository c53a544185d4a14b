"""Captures from disk: detect the format, check what is cheap to check, then decode."""

from __future__ import annotations

from pathlib import Path

from core.capture import WHITE, Capture
from core.datasets.budget import PIXEL_BUDGET, budget_notes, within_budget
from core.datasets.colmap import list_colmap
from core.datasets.decode import decoded
from core.datasets.detect import find_source, photos_without_poses
from core.datasets.listing import Listing
from core.datasets.llff import list_llff
from core.datasets.nerf_synthetic import list_nerf_synthetic
from core.datasets.nerfstudio import list_nerfstudio
from core.datasets.photo_folders import NO_REDUCTION, Reduction
from core.normalisation import normalised
from core.scene_kind import AUTO, chosen_kind

__all__ = ["Listing", "check_capture", "photos_without_poses", "read_capture"]


def check_capture(path: Path, *, skip_missing: bool = False, reduction: Reduction = NO_REDUCTION) -> Listing:
    """Everything that can be checked without decoding a pixel: poses, existence and headers of the photos.

    Args:
        path: a folder with photos and their poses (NeRF-synthetic, nerfstudio, COLMAP or LLFF), one that wraps such a
            folder, the pose file itself, or the folder of photos (images_8) of a COLMAP or LLFF capture.
        skip_missing: leave out photos that the poses name but the capture lacks (instant-ngp does), with a note,
            instead of refusing the capture.
        reduction: the size that the photos are wanted in. COLMAP and LLFF captures may have smaller copies of their
            photos, of which the fitting one is taken.

    Raises:
        CaptureNotFound, NoImages, PosesMissing, PosesInvalid, PoseNotFinite, PoseNotRigid, ImageMissing,
        ImageUndecodable, ImageTooLarge, ImageSizeMismatch, TooFewImages
    """
    source = find_source(Path(path))
    if source.is_nerf_synthetic:
        return list_nerf_synthetic(source.root, skip_missing=skip_missing)
    if source.is_colmap:
        models = list(source.pose_paths)
        return list_colmap(models, source.root, reduction, source.photo_folder, skip_missing=skip_missing)
    if source.is_llff:
        return list_llff(source.pose_paths[0], reduction, source.photo_folder)
    return list_nerfstudio(source.pose_paths[0], skip_missing=skip_missing)


def read_capture(
    path: Path,
    *,
    max_size_px: int | None = None,
    downscale: float = 1,
    background: tuple[float, float, float] = WHITE,
    skip_missing: bool = False,
    kind: str = AUTO,
    pixel_budget: int = PIXEL_BUDGET,
) -> Capture:
    """A capture from disk in the object frame, its photos undistorted and made smaller by area averaging.

    Memory is bounded: where no `max_size_px` says otherwise, photos are read as small as the budget demands, with a
    note (core/datasets/budget.py).

    Args:
        path, skip_missing: as for `check_capture`, which runs first.
        max_size_px: longest side of a photo at most.
        downscale: sides are divided by it, >= 1. Of both limits the stricter one holds. It is relative to the photos in
            full size, unless `path` names a folder of smaller ones.
        background: sRGB in [0, 1], behind transparent pixels.
        kind: of scene: "auto" (detected), "object", "forward" or "unbounded".
        pixel_budget: that all photos together may have where `max_size_px` is None.

    Raises:
        what `check_capture` raises, and ImageUndecodable, CaptureEmpty, OptionInvalid
    """
    scene_kind = chosen_kind(kind)
    asked = Reduction(downscale, max_size_px)
    found = check_capture(path, skip_missing=skip_missing, reduction=asked)
    reduction = within_budget(found, asked, pixel_budget)
    # Again, because there may be a smaller copy of the photos that will do.
    listing = check_capture(path, skip_missing=skip_missing, reduction=reduction) if reduction != asked else found
    train, test = decoded(listing, reduction)
    notes = listing.notes + budget_notes((found, asked), (listing, reduction), pixel_budget)
    capture = Capture(train, test, background, notes=notes, points=listing.points, kind=scene_kind)
    return normalised(capture, up_known=listing.up_known)
