"""Which format a capture has, from the files that lie in it."""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from core.datasets import llff, nerf_synthetic, nerfstudio
from core.datasets.colmap import cameras_file, capture_root, find_models
from core.datasets.masks import FOLDER as MASKS
from core.datasets.photo_folders import is_photo_folder_name
from core.errors import CaptureNotFound, NoImages, PosesMissing
from core.images import SUFFIXES

MAX_DEPTH = 3  # folders searched below the one given: a zip often wraps a capture in a folder or two
MAX_ENTRIES = 20_000
FORMATS = (
    f"{nerf_synthetic.TRAIN_FILE} (NeRF-synthetic), {nerfstudio.POSE_FILE} (nerfstudio, instant-ngp), a COLMAP model "
    f"in sparse/0 (cameras, images and points3D, .bin or .txt), or {llff.POSE_FILE} (LLFF)"
)


@dataclass(frozen=True)
class Source:
    """Where a capture's poses and photos are.

    Attributes:
        pose_paths: the pose file; of COLMAP captures the cameras file of each model.
        root: the capture's folder.
        photo_folder: that of the photos, if the user named one, as in fern/images_8.
    """

    pose_paths: tuple[Path, ...]
    root: Path
    photo_folder: Path | None = None

    @property
    def is_llff(self) -> bool:
        return self.pose_paths[0].suffix == ".npy"

    @property
    def is_colmap(self) -> bool:
        return self.pose_paths[0].suffix in (".bin", ".txt")

    @property
    def is_nerf_synthetic(self) -> bool:
        return self.pose_paths[0].name == nerf_synthetic.TRAIN_FILE


def find_source(path: Path) -> Source:
    """The capture at a path: a folder, one that wraps it, its folder of photos, or its pose file.

    Of several formats in one folder that which says most goes first: the split (NeRF-synthetic), distortion and masks
    (nerfstudio), lenses and points (COLMAP), bounds (LLFF).

    Raises:
        CaptureNotFound, NoImages, PosesMissing
    """
    if path.is_file():
        return _of_file(path)
    if not path.is_dir():
        raise CaptureNotFound(
            str(path),
            "must be a folder with photos and their poses",
            "nothing there",
            "Check the spelling of the path.",
        )
    named = _of_photo_folder(path)
    if named:
        return named
    folders = [path]
    for _ in range(MAX_DEPTH):
        found = [source for folder in folders if (source := _in_folder(folder))]
        if len(found) == 1:
            _check_has_photos(path if path in (found[0].root, *found[0].root.parents) else found[0].root)
            return found[0]
        if found:
            names = ", ".join(source.root.name for source in found[:5])
            raise _poses_missing(f"{len(found)} captures in it: {names}")
        folders = [child for folder in folders for child in _subfolders(folder)]
    _check_has_photos(path)
    raise _poses_missing("photos only")


def photos_without_poses(path: Path) -> list[Path] | None:
    """The photos of a folder that has photos but no poses in any format, sorted; None for everything else.

    Cheap: no photo is opened. Masks are not counted; where the folder, or the one that it wraps, has a folder
    `images`, only the photos in there are.
    """
    try:
        find_source(path)
    except PosesMissing:
        if not path.is_dir() or any(_in_folder(folder) for folder in _wrapped(path)):
            return None  # several captures
    except (CaptureNotFound, NoImages):
        return None
    else:
        return None
    folder = next((folder / "images" for folder in _wrapped(path) if (folder / "images").is_dir()), path)
    photos = list(_walk_photos(folder))
    return sorted(photos) if photos else None


def _of_file(path: Path) -> Source:
    if path.name in (f"cameras{suffix}" for suffix in (".bin", ".txt")) and cameras_file(path.parent):
        source = Source((path,), capture_root(path.parent))
    elif path.suffix.lower() in (".json", ".npy"):
        source = Source((path,), path.parent)
    else:
        raise CaptureNotFound(
            path.name,
            "must be a folder, or a pose file (.json, .npy, or cameras.bin of a COLMAP model)",
            "another file",
            "Give the folder.",
        )
    _check_has_photos(source.root)
    return source


def _of_photo_folder(path: Path) -> Source | None:
    """The LLFF or COLMAP capture whose folder of photos this is."""
    folder = path.absolute()
    if not is_photo_folder_name(folder.name) or _in_folder(path):
        return None
    source = _in_folder(folder.parent)
    if source is None or not (source.is_llff or source.is_colmap):
        return None
    _check_has_photos(path)
    return Source(source.pose_paths, source.root, folder)


def _in_folder(folder: Path) -> Source | None:
    for name in (nerf_synthetic.TRAIN_FILE, nerfstudio.POSE_FILE):
        if (folder / name).is_file():
            return Source((folder / name,), folder)
    models = find_models(folder)
    if models:
        return Source(tuple(models), capture_root(models[0].parent))
    return Source((folder / llff.POSE_FILE,), folder) if (folder / llff.POSE_FILE).is_file() else None


def _wrapped(path: Path) -> list[Path]:
    """The folder and those below it that are searched, from the top."""
    folders, level = [path], [path]
    for _ in range(MAX_DEPTH - 1):
        level = [child for folder in level for child in _subfolders(folder)]
        folders += level
    return folders


def _subfolders(folder: Path) -> list[Path]:
    return sorted(child for child in folder.iterdir() if child.is_dir() and not _is_clutter(child.name))


def _is_clutter(name: str) -> bool:
    return name.startswith(".") or name == "__MACOSX"


def _walk_photos(folder: Path) -> Iterator[Path]:
    """Photos in a folder and below, masks left out, until too many files have been seen."""
    seen = 0
    for base, names, files in os.walk(folder):
        names[:] = sorted(name for name in names if not _is_clutter(name) and name != MASKS)
        yield from (Path(base, file) for file in files if file.lower().endswith(SUFFIXES) and not _is_clutter(file))
        seen += len(files) + len(names)
        if seen > MAX_ENTRIES:
            return


def _check_has_photos(folder: Path) -> None:
    if next(_walk_photos(folder), None) is None:
        raise NoImages(
            "capture",
            "must contain photos",
            "none with the suffix " + ", ".join(SUFFIXES),
            "Add the photos as PNG, JPEG or WebP (convert HEIC and RAW first).",
        )


def _poses_missing(received: str) -> PosesMissing:
    return PosesMissing(
        "capture",
        f"must contain the photos' poses: {FORMATS}",
        received,
        "Pose the photos with COLMAP, nerfstudio's ns-process-data or instant-ngp's colmap2nerf.py, and add its files.",
    )
