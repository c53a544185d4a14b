"""Captures from disk: detect the format, check what is cheap to check, then decode."""

from __future__ import annotations

from pathlib import Path

from core.capture import WHITE, Capture
from core.datasets.decode import decoded
from core.datasets.detect import find_pose_file
from core.datasets.listing import Listing
from core.datasets.nerf_synthetic import TRAIN_FILE, list_nerf_synthetic
from core.datasets.nerfstudio import list_nerfstudio
from core.errors import OptionInvalid
from core.normalisation import normalised
from core.scene_kind import AUTO, chosen_kind

__all__ = ["Listing", "check_capture", "read_capture"]


def check_capture(path: Path, *, skip_missing: bool = False) -> Listing:
    """Everything that can be checked without decoding a pixel: poses, existence and headers of the photos.

    Args:
        path: a folder with photos and `transforms_train.json` (NeRF-synthetic) or `transforms.json` (nerfstudio,
            instant-ngp), or one that wraps such a folder, or the pose file itself.
        skip_missing: leave out photos that the pose file names but the capture lacks (instant-ngp does), with a note,
            instead of refusing the capture.

    Raises:
        CaptureNotFound, NoImages, PosesMissing, PosesInvalid, PoseNotFinite, PoseNotRigid, ImageMissing,
        ImageUndecodable, ImageTooLarge, ImageSizeMismatch, TooFewImages
    """
    pose_path = find_pose_file(Path(path))
    if pose_path.name == TRAIN_FILE:
        return list_nerf_synthetic(pose_path.parent, skip_missing=skip_missing)
    return list_nerfstudio(pose_path, skip_missing=skip_missing)


def read_capture(
    path: Path,
    *,
    max_size_px: int | None = None,
    downscale: float = 1,
    background: tuple[float, float, float] = WHITE,
    skip_missing: bool = False,
    kind: str = AUTO,
) -> Capture:
    """A capture from disk in the object frame, its photos undistorted and made smaller by area averaging.

    Args:
        path, skip_missing: as for `check_capture`, which runs first.
        max_size_px: longest side of a photo at most.
        downscale: sides are divided by it, >= 1. Of both limits the stricter one holds.
        background: sRGB in [0, 1], behind transparent pixels.
        kind: of scene: "auto" (detected), "object", "forward" or "unbounded".

    Raises:
        what `check_capture` raises, and ImageUndecodable, CaptureEmpty, OptionInvalid
    """
    if downscale < 1 or (max_size_px is not None and max_size_px < 1):
        raise OptionInvalid(
            "photo size",
            "downscale and max_size_px must be at least 1",
            f"{downscale} and {max_size_px}",
            "Leave them out.",
        )
    scene_kind = chosen_kind(kind)
    listing = check_capture(path, skip_missing=skip_missing)
    train, test = decoded(listing, max_size_px=max_size_px, downscale=downscale)
    return normalised(Capture(train, test, background, notes=listing.notes, kind=scene_kind))
