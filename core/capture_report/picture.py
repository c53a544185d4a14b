"""The capture report's picture: from which directions the scene was photographed, and the cameras from above."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from core.capture import Capture, View
from core.capture_report.canvas import INK, TITLE_SIZE, Canvas
from core.capture_report.coverage import COVERED_DEG
from core.capture_report.direction_map import NEAR, draw_direction_map
from core.capture_report.dot import FLAGGED, HELD_OUT, TRAIN, Dot
from core.capture_report.photo_quality import PhotoQuality
from core.capture_report.plan import draw_plan
from core.scene_kind import FORWARD

PANEL_PX, MARGIN_PX, TITLE_PX, LEGEND_PX = 520, 24, 48, 60
UP = np.array([0.0, 0.0, 1.0])


def coverage_picture(capture: Capture, photos: Sequence[PhotoQuality]) -> np.ndarray:
    """[h, w, 3] uint8: directions (or, of a forward-facing scene, its cameras from behind) and a top view.

    Args:
        capture: in the object frame.
        photos: the report's, whose flags are marked.
    """
    flagged = {photo.name for photo in photos if photo.blurred or photo.jumps}
    held_out = {id(view) for view in capture.test}
    views = (*capture.train, *capture.test)
    dots = [Dot(view, id(view) in held_out, view.camera.name in flagged) for view in views]
    canvas = Canvas(2 * PANEL_PX + 3 * MARGIN_PX, TITLE_PX + PANEL_PX + LEGEND_PX)
    left, right = MARGIN_PX, 2 * MARGIN_PX + PANEL_PX
    is_forward = capture.kind.name == FORWARD
    if is_forward:
        _title(canvas, left, "Cameras, as seen from behind")
        draw_plan(canvas, left, TITLE_PX, PANEL_PX, dots, None, _axes_from_behind(capture.train))
    else:
        _title(canvas, left, "Directions around the scene, from above")
        draw_direction_map(canvas, left, TITLE_PX, PANEL_PX, dots)
    _title(canvas, right, "Cameras and scene, from above")
    draw_plan(canvas, right, TITLE_PX, PANEL_PX, dots, capture.points, np.eye(3)[:2])
    _legend(canvas, dots, shaded=not is_forward)
    return canvas.pixels()


def _title(canvas: Canvas, x: float, text: str) -> None:
    canvas.text(x, TITLE_PX / 2, text, TITLE_SIZE, INK)


def _legend(canvas: Canvas, dots: Sequence[Dot], shaded: bool) -> None:
    x, y = MARGIN_PX + 6.0, TITLE_PX + PANEL_PX + LEGEND_PX / 2
    held_out = sum(dot.held_out for dot in dots)
    canvas.disc(x, y, 6, TRAIN)
    x += canvas.text(x + 14, y, f"{len(dots) - held_out} to train on") + 48
    if held_out:
        canvas.disc(x, y, 6, HELD_OUT)
        x += canvas.text(x + 14, y, f"{held_out} held out") + 48
    if any(dot.flagged for dot in dots):
        canvas.ring(x, y, 8, FLAGGED, 2.0)
        x += canvas.text(x + 16, y, "blurred, or exposure jumps") + 48
    canvas.cross(x, y, 7)
    x += canvas.text(x + 14, y, "what the cameras look at") + 48
    if shaded:
        canvas.disc(x, y, 8, NEAR)
        canvas.text(x + 16, y, f"within {COVERED_DEG:.0f}° of a photo")


def _axes_from_behind(views: Sequence[View]) -> np.ndarray:
    """[2, 3]: right and up, as someone behind the cameras has them."""
    forward = -np.array([view.camera.world_from_camera[:3, 2] for view in views]).mean(0)
    right = np.cross(forward, UP)
    length = float(np.linalg.norm(right))
    right = right / length if length > 1e-6 else np.array([1.0, 0.0, 0.0])
    up = np.cross(right, forward)
    return np.stack([right, up / max(float(np.linalg.norm(up)), 1e-9)])
