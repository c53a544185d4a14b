"""What photos tell of their lenses, and which photos share one.

Photos of one size that the same camera took at the same zoom share a lens: the more photos a lens has, the better its
focal length and distortion are known. Photos that say nothing (frames of a video, exports) share one by their size.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import pycolmap

from core.posing.headers import Header
from core.posing.photo_set import PhotoSet

DIAGONAL_35MM = math.hypot(36.0, 24.0)
# COLMAP's guess where nothing is known: a view of 45 degrees.
DEFAULT_FOCAL_FACTOR = 1.2
# One radial coefficient is what few photos can tell; with many, both radial and the tangential ones.
FEW_PHOTOS = 10
FEW_MODEL, MANY_MODEL = "SIMPLE_RADIAL", "OPENCV"


@dataclass(frozen=True)
class SharedLens:
    """Photos that share a lens.

    Attributes:
        names: of the photos, sorted.
        size_px: (width, height).
        focal_px: a first guess.
        focal_known: whether the guess is the camera's own statement.
    """

    names: tuple[str, ...]
    size_px: tuple[int, int]
    focal_px: float
    focal_known: bool

    @property
    def model(self) -> str:
        """COLMAP's name of the camera model that so many photos can determine."""
        return MANY_MODEL if len(self.names) >= FEW_PHOTOS else FEW_MODEL


def shared_lenses(photos: PhotoSet, headers: dict[str, Header]) -> list[SharedLens]:
    """The lenses of a set, in the order of their first photos."""
    groups: dict[tuple[object, ...], list[str]] = {}
    for name, header in headers.items():
        key = (header.size_px, header.camera, header.focal_mm, header.focal_35mm)
        groups.setdefault(key, []).append(name)
    return [_lens(photos, tuple(names), headers[names[0]]) for names in groups.values()]


def _lens(photos: PhotoSet, names: tuple[str, ...], header: Header) -> SharedLens:
    focal_px = _focal_px(header) or _focal_of_sensor(photos, names[0], header)
    guess = DEFAULT_FOCAL_FACTOR * max(header.size_px)
    return SharedLens(names, header.size_px, focal_px or guess, focal_known=focal_px is not None)


def _focal_px(header: Header) -> float | None:
    """35 mm equivalents are by the diagonal (CIPA DCG-001)."""
    if not header.focal_35mm:
        return None
    return header.focal_35mm / DIAGONAL_35MM * math.hypot(*header.stored_px)


def _focal_of_sensor(photos: PhotoSet, name: str, header: Header) -> float | None:
    """From the focal length in millimetres and COLMAP's list of sensors."""
    if not (header.focal_mm and header.camera):
        return None
    try:
        camera = pycolmap.infer_camera_from_image(photos.path(name))
    except Exception:  # it reads fewer formats than we do
        return None
    return float(camera.mean_focal_length()) if camera.has_prior_focal_length else None
