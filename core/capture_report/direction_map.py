"""A map of the directions around a scene, seen from above: where photos were taken from, and where none was."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from core.capture_report.canvas import INK, LINE, SOFT, TEXT_SIZE, Canvas
from core.capture_report.coverage import COVERED_DEG, directions_of, nearest_camera_deg
from core.capture_report.dot import Dot, draw_dot

NEAR, FAR = (206, 233, 211), (236, 237, 240)
LOWEST_DEG = -35.0  # how far below the horizon the map goes, unless cameras are lower
MARGIN_PX = 14


def draw_direction_map(canvas: Canvas, x0: int, y0: int, side: int, dots: Sequence[Dot]) -> None:
    """Equal areas (Lambert's azimuthal projection), the zenith in the middle, +x of the object frame to the right."""
    cameras = directions_of([dot.view for dot in dots])
    elevations = np.arcsin(np.clip(cameras[:, 2], -1.0, 1.0))
    lowest = max(-90.0, min(LOWEST_DEG, float(np.degrees(elevations.min())) - 5.0))
    outer, middle = _radius(np.radians(lowest)), side / 2
    scale = (middle - MARGIN_PX) / outer
    canvas.paste(x0, y0, _shaded(cameras, side, outer, scale))
    circles = {name: scale * _radius(np.radians(angle)) for name, angle in (("horizon", 0), ("30°", 30), ("60°", 60))}
    for name, radius in circles.items():
        canvas.ring(x0 + middle, y0 + middle, radius, SOFT if name == "horizon" else LINE)
    canvas.cross(x0 + middle, y0 + middle, 5)
    for dot, elevation, (x, y, _) in zip(dots, elevations, cameras, strict=True):
        stretch = scale * _radius(elevation) / max(float(np.hypot(x, y)), 1e-9)
        draw_dot(canvas, x0 + middle + x * stretch, y0 + middle - y * stretch, dot)
    for name, radius in circles.items():
        canvas.text(x0 + middle, y0 + middle - radius, name, TEXT_SIZE, INK, "mm")


def _radius(elevation_rad: float) -> float:
    return float(np.sqrt(2.0) * np.sin((np.pi / 2 - elevation_rad) / 2))


def _shaded(cameras: np.ndarray, side: int, outer: float, scale: float) -> np.ndarray:
    """[side, side, 3] uint8: green where a camera is near, grey where none is, white beyond the map."""
    y, x = (np.mgrid[:side, :side] + 0.5 - side / 2) / scale
    radius = np.hypot(x, y)
    colatitude = 2 * np.arcsin(np.clip(radius / np.sqrt(2.0), 0, 1))
    flat = np.sin(colatitude) / np.maximum(radius, 1e-9)
    directions = np.stack([x * flat, -y * flat, np.cos(colatitude)], -1)
    nearest = np.stack([nearest_camera_deg(row, cameras) for row in directions])
    # Fades around the angle up to which a direction counts as covered.
    share = np.clip(nearest / COVERED_DEG * 2 - 1.5, 0, 1)[..., None]
    color = np.array(NEAR) * (1 - share) + np.array(FAR) * share
    return np.rint(np.where((radius <= outer)[..., None], color, 255.0)).astype(np.uint8)
