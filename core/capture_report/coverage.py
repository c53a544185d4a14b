"""From where a scene was photographed. Everything is in the object frame: +z up, the centre of interest at the origin.

A direction here leads from the origin to a camera.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from core.capture import View

# A direction counts as covered up to this angle from a camera: shine and hidden corners change little within it.
COVERED_DEG = 20.0
SAMPLES = 2000
# Nearer to the zenith a heading says nothing.
STEEP_DEG = 75.0


@dataclass(frozen=True)
class Coverage:
    """Attributes:
    upper_share: of the directions from above, those within 20 degrees of a camera, 0 to 1.
    elevation_deg: (lowest, highest) camera, above the horizon.
    gap_deg: the widest sector of headings without a camera; 360 where cameras stand in one heading only.
    spread: (width, height) of the cameras as seen along their mean axis, in the user's units.
    axis_deg: the widest angle between an optical axis and their mean.
    """

    upper_share: float
    elevation_deg: tuple[float, float]
    gap_deg: float
    spread: tuple[float, float]
    axis_deg: float


def coverage_of(views: Sequence[View], user_unit: float = 1.0) -> Coverage:
    """The coverage of at least one view.

    Args:
        user_unit: length of the object frame's unit in the user's.
    """
    directions = directions_of(views)
    elevations = np.degrees(np.arcsin(np.clip(directions[:, 2], -1.0, 1.0)))
    return Coverage(
        upper_share=float((nearest_camera_deg(_upper_hemisphere(), directions) <= COVERED_DEG).mean()),
        elevation_deg=(float(elevations.min()), float(elevations.max())),
        gap_deg=_widest_gap_deg(directions[np.abs(elevations) < STEEP_DEG]),
        spread=_spread(views, user_unit),
        axis_deg=_widest_axis_deg(views),
    )


def directions_of(views: Sequence[View]) -> np.ndarray:
    """[n, 3] unit directions from the origin to the cameras; up for a camera at the origin itself."""
    positions = np.array([view.camera.position for view in views])
    lengths = np.linalg.norm(positions, axis=1, keepdims=True)
    return np.where(lengths > 1e-9, positions / np.maximum(lengths, 1e-9), [0.0, 0.0, 1.0])


def nearest_camera_deg(directions: np.ndarray, cameras: np.ndarray) -> np.ndarray:
    """[n]: the angle from each direction [n, 3] to the nearest of the cameras' [m, 3]."""
    return np.degrees(np.arccos(np.clip((directions @ cameras.T).max(1), -1.0, 1.0)))


def _upper_hemisphere() -> np.ndarray:
    """[SAMPLES, 3] unit directions, evenly spread (Fibonacci)."""
    index = np.arange(SAMPLES)
    z = (index + 0.5) / SAMPLES
    heading = index * np.pi * (3.0 - np.sqrt(5.0))
    radius = np.sqrt(1.0 - z * z)
    return np.stack([radius * np.cos(heading), radius * np.sin(heading), z], -1)


def _widest_gap_deg(directions: np.ndarray) -> float:
    if len(directions) == 0:
        return 360.0
    headings = np.sort(np.degrees(np.arctan2(directions[:, 1], directions[:, 0])))
    return float(np.diff(np.append(headings, headings[0] + 360.0)).max())


def _spread(views: Sequence[View], user_unit: float) -> tuple[float, float]:
    positions = np.array([view.camera.position for view in views])
    forward = _mean_axis(views)
    right = np.cross(forward, [0.0, 0.0, 1.0])
    if np.linalg.norm(right) < 1e-6:
        right = np.array([1.0, 0.0, 0.0])
    right /= np.linalg.norm(right)
    width, height = (float(np.ptp(positions @ axis)) * user_unit for axis in (right, np.cross(right, forward)))
    return width, height


def _widest_axis_deg(views: Sequence[View]) -> float:
    axes = np.array([-view.camera.world_from_camera[:3, 2] for view in views])
    return float(np.degrees(np.arccos(np.clip(axes @ _mean_axis(views), -1.0, 1.0))).max())


def _mean_axis(views: Sequence[View]) -> np.ndarray:
    mean = -np.array([view.camera.world_from_camera[:3, 2] for view in views]).mean(0)
    length = float(np.linalg.norm(mean))
    return mean / length if length > 1e-6 else np.array([0.0, 1.0, 0.0])
