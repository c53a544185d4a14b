"""What photos' files tell before they are decoded."""

from __future__ import annotations

import math
from dataclasses import dataclass

from PIL import Image

from core.images import read_exif, read_size
from core.posing.photo_set import PhotoSet

TAG_MAKE, TAG_MODEL, TAG_ORIENTATION, EXIF_IFD = 0x010F, 0x0110, 0x0112, 0x8769
TAG_FOCAL_MM, TAG_FOCAL_35MM = 0x920A, 0xA405


@dataclass(frozen=True)
class Header:
    """What a photo's file tells before it is decoded.

    Attributes:
        stored_px: (width, height) as stored.
        orientation: EXIF's, 1 to 8; 1 is upright.
        camera: make and model; "" if not told.
        focal_mm, focal_35mm: of the lens, and as if on 35 mm film; 0 if not told.
    """

    stored_px: tuple[int, int]
    orientation: int
    camera: str
    focal_mm: float
    focal_35mm: float

    @property
    def size_px(self) -> tuple[int, int]:
        """(width, height) of the upright photo."""
        width, height = self.stored_px
        return (height, width) if self.orientation >= 5 else (width, height)


def read_headers(photos: PhotoSet) -> dict[str, Header]:
    """The headers of all readable photos, by name."""
    return {name: _header(photos, name) for name in photos.names}


def _header(photos: PhotoSet, name: str) -> Header:
    path = photos.path(name)
    exif = read_exif(path, name)
    lens = _ifd(exif)
    camera = " ".join(str(exif.get(tag, "")).strip("\0 ") for tag in (TAG_MAKE, TAG_MODEL)).strip()
    orientation = exif.get(TAG_ORIENTATION, 1)
    return Header(
        read_size(path, name),
        orientation if isinstance(orientation, int) and 1 <= orientation <= 8 else 1,
        camera,
        _length(lens.get(TAG_FOCAL_MM)),
        _length(lens.get(TAG_FOCAL_35MM)),
    )


def _ifd(exif: Image.Exif) -> dict[int, object]:
    try:
        return dict(exif.get_ifd(EXIF_IFD))
    except Exception:  # parsers raise anything on hostile bytes
        return {}


def _length(value: object) -> float:
    try:
        length = float(value)  # type: ignore[arg-type]
    except (TypeError, ValueError, ZeroDivisionError):
        return 0.0
    return length if math.isfinite(length) and 0 < length < 5000 else 0.0
