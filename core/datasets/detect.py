"""Which format a capture has, from the files that lie in it."""

from __future__ import annotations

import os
from pathlib import Path

from core.datasets.nerf_synthetic import TRAIN_FILE
from core.datasets.nerfstudio import POSE_FILE
from core.errors import CaptureNotFound, NoImages, PosesMissing
from core.images import SUFFIXES

MAX_DEPTH = 3  # folders searched below the one given: a zip often wraps a capture in a folder or two
MAX_ENTRIES = 20_000


def find_pose_file(path: Path) -> Path:
    """The pose file of a capture: the path itself if it is a file, else the folder's, or its only capture sub-folder's.

    Where both formats are there, `transforms_train.json` goes first, because it states the split.

    Raises:
        CaptureNotFound, NoImages, PosesMissing
    """
    if path.is_file():
        return _checked_file(path)
    if not path.is_dir():
        raise CaptureNotFound(
            str(path),
            "must be a folder with photos and their poses",
            "nothing there",
            "Check the spelling of the path.",
        )
    folders = [path]
    for _ in range(MAX_DEPTH):
        found = [pose for folder in folders if (pose := _pose_file_in(folder))]
        if len(found) == 1:
            _check_has_photos(path)
            return found[0]
        if found:
            raise _poses_missing(
                path, f"{len(found)} captures in it: {', '.join(pose.parent.name for pose in found[:5])}"
            )
        folders = [child for folder in folders for child in _subfolders(folder)]
    _check_has_photos(path)
    raise _poses_missing(path, _what_instead(path))


def _checked_file(path: Path) -> Path:
    if path.suffix.lower() != ".json":
        raise CaptureNotFound(path.name, "must be a folder or a pose file (.json)", "another file", "Give the folder.")
    _check_has_photos(path.parent)
    return path


def _pose_file_in(folder: Path) -> Path | None:
    return next((folder / name for name in (TRAIN_FILE, POSE_FILE) if (folder / name).is_file()), None)


def _subfolders(folder: Path) -> list[Path]:
    return sorted(child for child in folder.iterdir() if child.is_dir() and not _is_clutter(child.name))


def _is_clutter(name: str) -> bool:
    return name.startswith(".") or name == "__MACOSX"


def _check_has_photos(folder: Path) -> None:
    seen = 0
    for _, names, files in os.walk(folder):
        names[:] = [name for name in names if not _is_clutter(name)]
        if any(file.lower().endswith(SUFFIXES) and not _is_clutter(file) for file in files):
            return
        seen += len(files) + len(names)
        if seen > MAX_ENTRIES:
            break
    raise NoImages(
        "capture",
        "must contain photos",
        "none with the suffix " + ", ".join(SUFFIXES),
        "Add the photos as PNG, JPEG or WebP (convert HEIC and RAW first).",
    )


def _what_instead(folder: Path) -> str:
    if next(folder.rglob("poses_bounds.npy"), None):
        return "photos with poses_bounds.npy (LLFF), which is not read yet"
    if next(folder.rglob("cameras.bin"), None) or next(folder.rglob("cameras.txt"), None):
        return "photos with a COLMAP model, which is not read yet"
    return "photos only"


def _poses_missing(folder: Path, received: str) -> PosesMissing:
    return PosesMissing(
        "capture",
        f"must contain one pose file, {TRAIN_FILE} (NeRF-synthetic) or {POSE_FILE} (nerfstudio, instant-ngp)",
        received,
        "Pose the photos with nerfstudio's ns-process-data or instant-ngp's colmap2nerf.py, and add their file.",
    )
