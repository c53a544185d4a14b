"""The photos of a folder that has no poses."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path

from core.errors import InputError, NoImages, TooFewImages
from core.images import SUFFIXES, read_size

MIN_PHOTOS = 3  # two give no scale to check against; COLMAP starts from a pair and needs another to go on
# Folders beside the photos that hold pictures which are no photos.
NOT_PHOTOS = ("mask", "masks", "depth", "depths", "normal", "normals", "thumbs", "thumbnails")


@dataclass(frozen=True)
class PhotoSet:
    """Photos of one scene, readable by their headers.

    Attributes:
        folder: they are named relative to it.
        names: POSIX paths, sorted: the order in which they were taken, for most cameras.
        unreadable: names of photos that cannot be used, with the reason.
    """

    folder: Path
    names: tuple[str, ...]
    unreadable: dict[str, str]

    def path(self, name: str) -> Path:
        return self.folder / name


def find_photo_set(folder: Path) -> PhotoSet:
    """All photos in a folder and below, except in folders called "masks" and the like. Headers are checked.

    The set's own folder is the one that holds them all, such as `images`. Other files (notes, calibration) do not disturb.

    Raises:
        NoImages, TooFewImages
    """
    names = sorted(_names_below(folder))
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
    return PhotoSet(folder, readable, unreadable)


def _names_below(folder: Path) -> list[str]:
    found = []
    for path in folder.rglob("*"):
        parts = path.relative_to(folder).parts
        hidden = any(part.startswith(".") or part == "__MACOSX" for part in parts)
        aside = any(part.lower() in NOT_PHOTOS for part in parts[:-1])
        if path.suffix.lower() in SUFFIXES and not hidden and not aside and path.is_file():
            found.append("/".join(parts))
    return found


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
