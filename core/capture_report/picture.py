"""The capture report's picture: from which directions the scene was photographed, and the cameras from above."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from core.capture import Capture, View
from core.capture_report.coverage import COVERED_DEG, directions_of, nearest_camera_deg
from core.capture_report.photo_quality import PhotoQuality
from core.errors import InputError
from core.images import read_reduced
from core.scene_kind import FORWARD

PANEL_PX, MARGIN_PX, TITLE_PX, LEGEND_PX = 520, 24, 40, 44
SMOOTH = 2  # drawn so many times larger, then reduced
PAPER, INK, SOFT, LINE = (255, 255, 255), (34, 38, 46), (108, 114, 126), (214, 218, 225)
TRAIN, HELD, FLAGGED, POINT = (36, 92, 214), (232, 132, 12), (206, 34, 50), (150, 156, 166)
NEAR, FAR = (206, 233, 211), (236, 237, 240)
LOWEST_DEG = -35.0  # how far below the horizon the map of directions goes, unless cameras are lower
MAX_POINTS = 20_000
COLUMNS, SIDE_PX, GAP_PX, MAX_SHOWN = 6, 170, 12, 24  # of the sheet of photos
UP = np.array([0.0, 0.0, 1.0])


def coverage_picture(capture: Capture, photos: Sequence[PhotoQuality]) -> np.ndarray:
    """[h, w, 3] uint8: directions (or, of a forward-facing scene, its cameras from behind) and a top view.

    Args:
        capture: in the object frame.
        photos: the report's, whose flags are marked.
    """
    flagged = {photo.name for photo in photos if photo.blurred or photo.jumps}
    dots = [_Dot.of(view, False, flagged) for view in capture.train] + [
        _Dot.of(view, True, flagged) for view in capture.test
    ]
    canvas = _Canvas(2 * PANEL_PX + 3 * MARGIN_PX, PANEL_PX + TITLE_PX + LEGEND_PX + MARGIN_PX)
    left, right = (MARGIN_PX, TITLE_PX), (2 * MARGIN_PX + PANEL_PX, TITLE_PX)
    if capture.kind.name == FORWARD:
        _plan(canvas, left, "Cameras, as seen from behind", dots, None, _axes_from_behind(capture.train))
    else:
        _direction_map(canvas, left, dots)
    _plan(canvas, right, "Cameras and scene, from above", dots, capture.points, np.eye(3)[:2])
    _legend(canvas, dots, shaded=capture.kind.name != FORWARD)
    return canvas.pixels()


def photos_picture(folder: Path, names: Sequence[str]) -> np.ndarray:
    """[h, w, 3] uint8: what stands in for the picture where there are no cameras: some of the photos, named."""
    shown = names[:: max(1, -(-len(names) // MAX_SHOWN))]
    rows = max(1, -(-len(shown) // COLUMNS))
    cell, below = SIDE_PX + GAP_PX, 22
    canvas = _Canvas(COLUMNS * cell + GAP_PX, rows * (cell + below) + GAP_PX)
    for index, name in enumerate(shown):
        row, column = divmod(index, COLUMNS)
        x, y = GAP_PX + column * cell, GAP_PX + row * (cell + below)
        try:
            canvas.paste(x, y, _over_white(read_reduced(folder / name, SIDE_PX)))
        except InputError:
            canvas.text(x, y + SIDE_PX / 2, "cannot be decoded", color=FLAGGED)
        canvas.text(x, y + SIDE_PX + below / 2, name if len(name) < 24 else f"...{name[-20:]}", 12)
    return canvas.pixels()


def _over_white(photo_u8: np.ndarray) -> np.ndarray:
    if photo_u8.shape[2] == 3:
        return photo_u8
    alpha = photo_u8[..., 3:] / 255.0
    return np.rint(photo_u8[..., :3] * alpha + 255.0 * (1.0 - alpha)).astype(np.uint8)


@dataclass(frozen=True)
class _Dot:
    view: View
    color: tuple[int, int, int]
    flagged: bool

    @classmethod
    def of(cls, view: View, held_out: bool, flagged: set[str]) -> _Dot:
        return cls(view, HELD if held_out else TRAIN, view.camera.name in flagged)


class _Canvas:
    """Drawing in pixels of the finished picture."""

    def __init__(self, width: int, height: int) -> None:
        self._image = Image.new("RGB", (width * SMOOTH, height * SMOOTH), PAPER)
        self.draw = ImageDraw.Draw(self._image)
        self.size = width, height

    def line(self, points: Sequence[tuple[float, float]], color: tuple[int, int, int], width: float = 1.0) -> None:
        scaled = [(x * SMOOTH, y * SMOOTH) for x, y in points]
        self.draw.line(scaled, fill=color, width=max(1, round(width * SMOOTH)), joint="curve")

    def circle(
        self, x: float, y: float, radius: float, fill: tuple[int, int, int] | None = None,
        outline: tuple[int, int, int] | None = None, width: float = 1.0,
    ) -> None:  # fmt: skip
        box = [(v) * SMOOTH for v in (x - radius, y - radius, x + radius, y + radius)]
        self.draw.ellipse(box, fill, outline, max(1, round(width * SMOOTH)))

    def text(self, x: float, y: float, text: str, size: int = 13, color: tuple[int, int, int] = SOFT,
             anchor: str = "lm", halo: bool = False) -> None:  # fmt: skip
        font = ImageFont.load_default(size * SMOOTH)
        at, edge = (x * SMOOTH, y * SMOOTH), 3 * SMOOTH if halo else 0
        self.draw.text(at, text, fill=color, font=font, anchor=anchor, stroke_width=edge, stroke_fill=PAPER)

    def paste(self, x: int, y: int, image_u8: np.ndarray) -> None:
        height, width = image_u8.shape[:2]
        large = Image.fromarray(image_u8).resize((width * SMOOTH, height * SMOOTH), Image.Resampling.BILINEAR)
        self._image.paste(large, (x * SMOOTH, y * SMOOTH))

    def pixels(self) -> np.ndarray:
        return np.asarray(self._image.resize(self.size, Image.Resampling.BOX))

    def dot(self, x: float, y: float, dot: _Dot, radius: float = 4.5) -> None:
        self.circle(x, y, radius, fill=dot.color, outline=PAPER, width=1.0)
        if dot.flagged:
            self.circle(x, y, radius + 3.5, outline=FLAGGED, width=2.0)


def _direction_map(canvas: _Canvas, corner: tuple[int, int], dots: Sequence[_Dot]) -> None:
    """Equal areas, the zenith in the middle: how well each direction is covered, and the cameras."""
    x0, y0 = corner
    canvas.text(x0, y0 / 2, "Directions around the scene, from above", 15, INK)
    cameras = directions_of([dot.view for dot in dots])
    lowest = min(LOWEST_DEG, float(np.degrees(np.arcsin(np.clip(cameras[:, 2], -1, 1))).min()) - 5.0)
    outer = _equal_area(np.radians(max(lowest, -90.0)))
    half = PANEL_PX / 2
    scale = (half - 14) / outer
    canvas.paste(x0, y0, _shaded_map(cameras, outer, scale))
    for elevation in (0, 30, 60):
        radius = scale * _equal_area(np.radians(elevation))
        canvas.circle(x0 + half, y0 + half, radius, outline=SOFT if elevation == 0 else LINE)
    canvas.line([(x0 + half - 5, y0 + half), (x0 + half + 5, y0 + half)], SOFT)
    canvas.line([(x0 + half, y0 + half - 5), (x0 + half, y0 + half + 5)], SOFT)
    for dot, (dx, dy, dz) in zip(dots, cameras, strict=True):
        flat = np.hypot(dx, dy)
        radius = scale * _equal_area(np.arcsin(np.clip(dz, -1, 1))) / max(flat, 1e-9)
        canvas.dot(x0 + half + dx * radius, y0 + half - dy * radius, dot)
    for elevation in (0, 30, 60):  # over the dots
        name = "horizon" if elevation == 0 else f"{elevation}°"
        canvas.text(x0 + half, y0 + half - scale * _equal_area(np.radians(elevation)), name, 12, INK, "mm", halo=True)


def _equal_area(elevation_rad: float) -> float:
    """Lambert's azimuthal equal-area radius."""
    return float(np.sqrt(2.0) * np.sin((np.pi / 2 - elevation_rad) / 2))


def _shaded_map(cameras: np.ndarray, outer: float, scale: float) -> np.ndarray:
    """[PANEL_PX, PANEL_PX, 3] uint8: green where a camera is near, grey where none is."""
    y, x = (np.mgrid[:PANEL_PX, :PANEL_PX] + 0.5 - PANEL_PX / 2) / scale
    radius = np.hypot(x, y)
    colatitude = 2 * np.arcsin(np.clip(radius / np.sqrt(2.0), 0, 1))
    flat = np.sin(colatitude) / np.maximum(radius, 1e-9)
    directions = np.stack([x * flat, -y * flat, np.cos(colatitude)], -1)
    near = np.concatenate([nearest_camera_deg(row, cameras)[None] for row in directions])
    share = np.clip((near - COVERED_DEG * 0.75) / (COVERED_DEG * 0.75), 0, 1)[..., None]
    color = np.array(NEAR) * (1 - share) + np.array(FAR) * share
    return np.rint(np.where((radius <= outer)[..., None], color, 255.0)).astype(np.uint8)


def _plan(
    canvas: _Canvas, corner: tuple[int, int], title: str, dots: Sequence[_Dot], points: np.ndarray | None,
    axes: np.ndarray,
) -> None:  # fmt: skip
    """Cameras with their views, and sparse points, along two axes [2, 3] of the object frame (right, up)."""
    x0, y0 = corner
    canvas.text(x0, y0 / 2, title, 15, INK)
    canvas.draw.rectangle(
        [v * SMOOTH for v in (x0, y0, x0 + PANEL_PX, y0 + PANEL_PX)], fill=(248, 249, 251), outline=LINE
    )
    cameras = np.array([dot.view.camera.position for dot in dots]) @ axes.T
    shown = np.zeros((0, 2)) if points is None else points @ axes.T
    middle, reach = _extent(cameras, shown)
    scale = (PANEL_PX / 2 - 26) / reach

    def place(flat: np.ndarray) -> tuple[float, float]:
        x, y = (flat - middle) * scale
        return x0 + PANEL_PX / 2 + x, y0 + PANEL_PX / 2 - y

    _cross(canvas, *place(np.zeros(2)))
    for x, y in map(place, shown[:: max(1, len(shown) // MAX_POINTS)]):
        if x0 + 1 < x < x0 + PANEL_PX - 2 and y0 + 1 < y < y0 + PANEL_PX - 2:
            canvas.circle(x, y, 0.7, fill=POINT)
    for dot, camera in zip(dots, cameras, strict=True):
        _wedge(canvas, place, dot, camera, axes, 28.0 / scale)
    for dot, camera in zip(dots, cameras, strict=True):
        canvas.dot(*place(camera), dot, 3.5)


def _extent(cameras: np.ndarray, points: np.ndarray) -> tuple[np.ndarray, float]:
    """(middle [2], half side) of a square with all cameras, the origin, and most points unless these go far beyond."""
    known = np.concatenate([cameras, np.zeros((1, 2))])
    low, high = known.min(0), known.max(0)
    if len(points):
        beyond = 2.0 * max(float((high - low).max()), 1e-9)
        point_low, point_high = np.percentile(points, [3, 97], axis=0)
        low = np.minimum(low, np.maximum(point_low, low - beyond))
        high = np.maximum(high, np.minimum(point_high, high + beyond))
    return (low + high) / 2, max(float((high - low).max()) / 2, 1e-9)


def _cross(canvas: _Canvas, x: float, y: float) -> None:
    canvas.line([(x - 8, y), (x + 8, y)], SOFT)
    canvas.line([(x, y - 8), (x, y + 8)], SOFT)


def _wedge(canvas: _Canvas, place: object, dot: _Dot, at: np.ndarray, axes: np.ndarray, length: float) -> None:
    """The edges of a photo's view, flattened."""
    camera = dot.view.camera
    width, height = camera.size_px
    ends = [(0.0, height / 2), (float(width), height / 2)]
    if abs(float(np.cross(axes[0], axes[1]) @ camera.world_from_camera[:3, 2])) > 0.7:
        return  # it looks along the drawing's own axis
    pale = tuple(round(0.5 * value + 127.5) for value in dot.color)
    for end in ends:
        direction = camera.directions(np.array(end)) @ axes.T
        canvas.line([place(at), place(at + length * direction)], pale)  # type: ignore[operator, arg-type]


def _axes_from_behind(views: Sequence[View]) -> np.ndarray:
    """[2, 3]: right and up, as someone behind the cameras has them."""
    forward = -np.array([view.camera.world_from_camera[:3, 2] for view in views]).mean(0)
    right = np.cross(forward, UP)
    length = float(np.linalg.norm(right))
    right = right / length if length > 1e-6 else np.array([1.0, 0.0, 0.0])
    up = np.cross(right, forward)
    return np.stack([right, up / max(float(np.linalg.norm(up)), 1e-9)])


def _legend(canvas: _Canvas, dots: Sequence[_Dot], shaded: bool) -> None:
    x, y = MARGIN_PX + 6.0, TITLE_PX + PANEL_PX + (LEGEND_PX + MARGIN_PX) / 2
    held = [dot for dot in dots if dot.color == HELD]
    entries: list[tuple[tuple[int, int, int] | None, str]] = [(TRAIN, f"{len(dots) - len(held)} photos to train on")]
    if held:
        entries.append((HELD, f"{len(held)} held out"))
    for color, text in entries:
        canvas.circle(x, y, 4.5, fill=color)
        canvas.text(x + 10, y, text)
        x += 40 + 7.2 * len(text)
    if any(dot.flagged for dot in dots):
        canvas.circle(x, y, 7, outline=FLAGGED, width=2.0)
        canvas.text(x + 14, y, "blurred, or exposure jumps")
        x += 220
    canvas.line([(x - 6, y), (x + 6, y)], SOFT)
    canvas.line([(x, y - 6), (x, y + 6)], SOFT)
    canvas.text(x + 12, y, "what the cameras look at")
    x += 200
    if shaded:
        canvas.circle(x, y, 6, fill=NEAR)
        canvas.text(x + 12, y, f"within {COVERED_DEG:.0f}° of a photo")
