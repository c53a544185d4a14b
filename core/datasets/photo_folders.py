"""Which folder the photos are taken from: `images`, or a smaller copy of it (`images_2`, `images_4`, `images_8`)."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from core.errors import OptionInvalid
from core.images import SUFFIXES

FULL = "images"
SCALED = re.compile(r"images_(\d{1,3})")


@dataclass(frozen=True)
class Reduction:
    """How much smaller photos are wanted: sides divided by `downscale`, and at most `max_size_px` long.

    Raises:
        OptionInvalid: one of them is below 1.
    """

    downscale: float = 1.0
    max_size_px: int | None = None

    def __post_init__(self) -> None:
        if not self.downscale >= 1 or (self.max_size_px is not None and self.max_size_px < 1):
            raise OptionInvalid(
                "photo size",
                "downscale and max_size_px must be at least 1",
                f"{self.downscale} and {self.max_size_px}",
                "Leave them out.",
            )

    def factor(self, size_px: tuple[int, int], scale: float = 1.0) -> float:
        """The stricter of both, for a photo of (width, height) that is `scale` times reduced already; at least 1."""
        longest = max(size_px) / self.max_size_px if self.max_size_px else 1.0
        return max(1.0, self.downscale / scale, longest)


NO_REDUCTION = Reduction()


@dataclass(frozen=True)
class PhotoFolder:
    """Attributes:
    path: where the photos lie.
    scale: how many times smaller they are than the posed ones, by the folder's name.
    """

    path: Path
    scale: int = 1


def is_photo_folder_name(name: str) -> bool:
    return name == FULL or SCALED.fullmatch(name) is not None


def chosen_folder(
    root: Path, full_size_px: tuple[int, int], reduction: Reduction, holds_photos: Callable[[Path], bool]
) -> PhotoFolder:
    """The smallest copy that is still large enough for what is wanted; else the largest; else the root itself.

    Args:
        full_size_px: (width, height) of the posed photos.
        holds_photos: whether a folder has this capture's photos.
    """
    folders = {1: root / FULL} | {
        int(match[1]): child for child in sorted(root.iterdir()) if (match := SCALED.fullmatch(child.name))
    }
    scales = sorted(scale for scale, path in folders.items() if scale >= 1 and path.is_dir() and holds_photos(path))
    if not scales:
        return PhotoFolder(root)
    wanted = reduction.factor(full_size_px) * (1 + 1e-6)
    scale = max((scale for scale in scales if scale <= wanted), default=scales[0])
    return PhotoFolder(folders[scale], scale)


def photos_in(folder: Path) -> list[Path]:
    """Photos that lie in the folder itself, sorted by name."""
    paths = [
        path for path in folder.iterdir() if path.name.lower().endswith(SUFFIXES) and not path.name.startswith(".")
    ]
    return sorted(path for path in paths if path.is_file())
