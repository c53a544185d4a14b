"""Where a pose file's photos lie. Names are matched inside the capture's folder only."""

from __future__ import annotations

import re
from pathlib import Path, PurePosixPath

from core.errors import ImageMissing, PosesInvalid
from core.images import SUFFIXES

MAX_NAMED = 5


class PhotoFinder:
    """Finds photos by `file_path`, and collects the missing ones to name them together."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.missing: list[str] = []
        self._found: dict[Path, str] = {}

    def find(self, file_path: str) -> Path | None:
        """The photo's path; None (and noted as missing) where there is no such file.

        Suffixes may be left out (`./train/r_0`); folders may be gone (browsers upload photos without their folders).

        Raises:
            ImageMissing: the name leads out of the capture.
            PosesInvalid: the photo was found before.
        """
        relative = relative_photo_path(file_path)
        path = self._existing(relative)
        if path is None:
            self.missing.append(file_path)
            return None
        if path in self._found:
            raise PosesInvalid(
                "pose file",
                "every photo may have one pose only",
                f"{file_path} and {self._found[path]} for {path.relative_to(self.folder)}",
                "Remove one of the two frames.",
            )
        self._found[path] = file_path
        return path

    def check_none_missing(self) -> tuple[str, ...]:
        """No notes; raises ImageMissing that names up to five photos."""
        if self.missing:
            raise ImageMissing(
                "capture",
                "must contain every photo that its pose file names",
                f"{len(self.missing)} missing: {self._named()}",
                "Add these photos, or leave them out: --skip-missing (API: skip_missing=true).",
            )
        return ()

    def left_out(self) -> tuple[str, ...]:
        """A note that names up to five photos, if any is missing."""
        if not self.missing:
            return ()
        return (
            f"Left out {len(self.missing)} photos that the pose file names but the capture lacks: {self._named()}.",
        )

    def _named(self) -> str:
        more = len(self.missing) - MAX_NAMED
        return ", ".join(self.missing[:MAX_NAMED]) + (f" and {more} more" if more > 0 else "")

    def _existing(self, relative: PurePosixPath) -> Path | None:
        for candidate in (self.folder / relative, self.folder / relative.name):
            for suffix in ("", *SUFFIXES, *(suffix.upper() for suffix in SUFFIXES)):
                path = candidate.with_name(candidate.name + suffix)
                if _is_file(path):
                    return path
        return None


def relative_photo_path(file_path: str) -> PurePosixPath:
    """A pose file's `file_path` as a path below the capture's folder; backslashes count as slashes.

    Links are followed: they are the user's own (archives with links are refused when they are unpacked).

    Raises:
        ImageMissing: absolute, with "..", or no name at all.
    """
    path = PurePosixPath(file_path.replace("\\", "/"))
    if path.is_absolute() or ".." in path.parts or not path.name or re.match(r"^[A-Za-z]:", file_path):
        raise ImageMissing(
            f'file_path "{file_path[:80]}"',
            "must name a photo inside the capture's folder",
            "a path that leads elsewhere",
            'Use relative paths without "..", such as images/0001.jpg.',
        )
    return path


def _is_file(path: Path) -> bool:
    try:
        return path.is_file()
    except (OSError, ValueError):  # names too long, or with a NUL
        return False
