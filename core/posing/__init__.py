"""Cameras of photos that come without poses: incremental structure from motion by COLMAP (pycolmap), on the CPU.

    photos -> features (SIFT) -> matches of pairs that overlap -> cameras and points, one photo after another

The model is left in COLMAP's own format, which `core.datasets` reads like anybody's.
"""

from __future__ import annotations

from core.posing.photo_set import PhotoSet, find_photo_set
from core.posing.pose_photos import pose_photos
from core.posing.posing import LeftOut, Posing

__all__ = ["LeftOut", "PhotoSet", "Posing", "find_photo_set", "pose_photos"]
