"""Cameras and sparse points, seen along an axis."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from core.camera import Camera
from core.capture_report.canvas import Canvas, Color
from core.capture_report.dot import Dot, draw_dot

BACKGROUND: Color = (248, 249, 251)
POINT: Color = (150, 156, 166)
MAX_POINTS = 20_000
MARGIN_PX, WEDGE_PX = 26, 28.0
# Points show unless they lie further out than this many times the extent of the cameras.
FURTHEST_POINTS = 2.0
# Cameras that look nearly along the drawing's own axis have no direction in it.
FORESHORTENED = 0.7


@dataclass(frozen=True)
class Projection:
    """From the object frame to pixels.

    Attributes:
        axes: [2, 3], right and up of the drawing, orthonormal.
        middle: [2], along these axes, what lies in the centre.
        scale: pixels per unit.
        centre_px: of the drawing.
    """

    axes: np.ndarray
    middle: np.ndarray
    scale: float
    centre_px: tuple[float, float]

    def __call__(self, points: np.ndarray) -> np.ndarray:
        """Pixels [..., 2] of points [..., 3]."""
        return (points @ self.axes.T - self.middle) * self.scale * [1, -1] + self.centre_px


def draw_plan(
    canvas: Canvas, x0: int, y0: int, side: int, dots: Sequence[Dot], points: np.ndarray | None, axes: np.ndarray
) -> None:
    """Every camera with its field of view, and points [n, 3] of the object frame (None for none)."""
    canvas.frame(x0, y0, side, BACKGROUND)
    cameras = [dot.view.camera for dot in dots]
    shown = np.zeros((0, 3)) if points is None else points[:: max(1, len(points) // MAX_POINTS)]
    middle, reach = _extent(np.array([camera.position for camera in cameras]) @ axes.T, shown @ axes.T)
    project = Projection(axes, middle, (side / 2 - MARGIN_PX) / reach, (x0 + side / 2, y0 + side / 2))
    pixels = project(shown)
    inside = ((pixels > [x0 + 2, y0 + 2]) & (pixels < [x0 + side - 2, y0 + side - 2])).all(-1)
    for x, y in pixels[inside]:
        canvas.disc(x, y, 0.7, POINT)
    x, y = project(np.zeros(3))
    canvas.cross(x, y, 8)
    for dot, camera in zip(dots, cameras, strict=True):
        _draw_wedge(canvas, project, camera, dot.color)
    for dot, camera in zip(dots, cameras, strict=True):
        x, y = project(camera.position)
        draw_dot(canvas, x, y, dot, 5.0)


def _extent(cameras: np.ndarray, points: np.ndarray) -> tuple[np.ndarray, float]:
    """(middle [2], half side) of a square with the cameras [n, 2], the origin, and most points [m, 2]."""
    known = np.concatenate([cameras, np.zeros((1, 2))])
    low, high = known.min(0), known.max(0)
    if len(points):
        beyond = FURTHEST_POINTS * max(float((high - low).max()), 1e-9)
        point_low, point_high = np.percentile(points, [3, 97], axis=0)
        low, high = (
            np.minimum(low, np.maximum(point_low, low - beyond)),
            np.maximum(high, np.minimum(point_high, high + beyond)),
        )
    return (low + high) / 2, max(float((high - low).max()) / 2, 1e-9)


def _draw_wedge(canvas: Canvas, project: Projection, camera: Camera, color: Color) -> None:
    """The left and right edge of a photo's view."""
    along = np.cross(project.axes[0], project.axes[1])
    if abs(float(along @ camera.world_from_camera[:3, 2])) > FORESHORTENED:
        return
    width, height = camera.size_px
    edges = camera.directions(np.array([[0.0, height / 2], [width, height / 2]]))
    pale = (color[0] // 2 + 127, color[1] // 2 + 127, color[2] // 2 + 127)
    x, y = project(camera.position)
    for end_x, end_y in project(camera.position + edges * WEDGE_PX / project.scale):
        canvas.line([(x, y), (end_x, end_y)], pale)
