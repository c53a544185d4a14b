"""The photos of a folder that has no poses."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path

from core.datasets import photos_without_poses
from core.datasets.masks import FOLDER as MASKS
from core.errors import InputError, NoImages, TooFewImages
from core.images import SUFFIXES, read_size

MIN_PHOTOS = 3  # two give no scale to check against; COLMAP starts from a pair and needs another to go on
# Folders beside the photos that hold pictures which are no photos.
NOT_PHOTOS = ("mask", "depth", "depths", "normal", "normals", "thumbs", "thumbnails")


@dataclass(frozen=True)
class PhotoSet:
    """Photos of one scene, readable by their headers.

    Attributes:
        folder: they are named relative to it.
        names: POSIX paths, sorted: the order in which they were taken, for most cameras.
        unreadable: names of photos that cannot be used, with the reason.
        masks: folder of masks named after the photos, if there is one.
    """

    folder: Path
    names: tuple[str, ...]
    unreadable: dict[str, str]
    masks: Path | None = None

    def path(self, name: str) -> Path:
        return self.folder / name


def find_photo_set(folder: Path, *, without: Path | None = None) -> PhotoSet:
    """All photos of a folder without poses, except those in folders called "depth" and the like. Headers are checked.

    The set's own folder is the one that holds them all, such as `images`. Other files (notes, calibration) do not
    matter.

    Args:
        without: a folder, perhaps below, that is not looked into.

    Raises:
        NoImages, TooFewImages
    """
    names = sorted(name for name in _names_below(folder) if not (without and (folder / name).is_relative_to(without)))
    top = folder
    inner = os.path.commonpath([name.rpartition("/")[0] for name in names]) if names else ""
    if inner:
        folder, names = folder / inner, [name[len(inner) + 1 :] for name in names]
    unreadable: dict[str, str] = {}
    for name in names:
        try:
            read_size(folder / name, name)
        except InputError as error:
            unreadable[name] = error.received or error.rule
    readable = tuple(name for name in names if name not in unreadable)
    _check_count(names, readable)
    masks = next((path for path in (folder / MASKS, folder.parent / MASKS, top / MASKS) if path.is_dir()), None)
    return PhotoSet(folder, readable, unreadable, masks if masks and masks.is_relative_to(top) else None)


def _names_below(folder: Path) -> list[str]:
    paths = [path.relative_to(folder) for path in photos_without_poses(folder) or ()]
    return [path.as_posix() for path in paths if not any(part.lower() in NOT_PHOTOS for part in path.parts[:-1])]


def _check_count(names: list[str], readable: tuple[str, ...]) -> None:
    if not names:
        raise NoImages(
            "capture",
            "must contain photos",
            "none with the suffix " + ", ".join(SUFFIXES),
            "Add the photos as PNG, JPEG or WebP (convert HEIC and RAW first).",
        )
    if len(readable) < MIN_PHOTOS:
        raise TooFewImages(
            "photos without poses",
            f"at least {MIN_PHOTOS} readable photos are needed to estimate their cameras",
            f"{len(readable)} of {len(names)}",
            "Add photos from other directions; 30 to 100 all around give a good result.",
        )
