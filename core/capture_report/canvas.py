"""A drawing surface: shapes and text in pixels, smoothed by drawing larger and reducing."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from PIL import Image, ImageDraw, ImageFont

SMOOTH = 2
TITLE_SIZE, TEXT_SIZE = 20, 17  # pages show the pictures at half their size
Color = tuple[int, int, int]
PAPER: Color = (255, 255, 255)
INK: Color = (34, 38, 46)
SOFT: Color = (108, 114, 126)
LINE: Color = (214, 218, 225)


class Canvas:
    """Coordinates and sizes are pixels of the finished picture; (0, 0) is its top left corner."""

    def __init__(self, width: int, height: int) -> None:
        self.size = width, height
        self._image = Image.new("RGB", (width * SMOOTH, height * SMOOTH), PAPER)
        self._draw = ImageDraw.Draw(self._image)

    def line(self, points: Sequence[tuple[float, float]], color: Color, width: float = 1.0) -> None:
        scaled = [(x * SMOOTH, y * SMOOTH) for x, y in points]
        self._draw.line(scaled, fill=color, width=max(1, round(width * SMOOTH)), joint="curve")

    def cross(self, x: float, y: float, arm: float, color: Color = SOFT) -> None:
        self.line([(x - arm, y), (x + arm, y)], color)
        self.line([(x, y - arm), (x, y + arm)], color)

    def disc(self, x: float, y: float, radius: float, color: Color, rim: Color | None = None) -> None:
        self._draw.ellipse(_box(x, y, radius), color, rim, SMOOTH)

    def ring(self, x: float, y: float, radius: float, color: Color, width: float = 1.0) -> None:
        self._draw.ellipse(_box(x, y, radius), None, color, round(width * SMOOTH))

    def frame(self, x: float, y: float, side: float, fill: Color) -> None:
        self._draw.rectangle([v * SMOOTH for v in (x, y, x + side, y + side)], fill, LINE)

    def text(
        self, x: float, y: float, text: str, size: int = TEXT_SIZE, color: Color = SOFT, anchor: str = "lm"
    ) -> float:
        """Writes with a halo, so that it reads over anything; returns the width."""
        font = ImageFont.load_default(size * SMOOTH)
        at = x * SMOOTH, y * SMOOTH
        self._draw.text(at, text, fill=color, font=font, anchor=anchor, stroke_width=2 * SMOOTH, stroke_fill=PAPER)
        return self._draw.textlength(text, font) / SMOOTH

    def paste(self, x: int, y: int, image_u8: np.ndarray) -> None:
        """An image [h, w, 3] uint8 with its top left corner at (x, y)."""
        height, width = image_u8.shape[:2]
        large = Image.fromarray(image_u8).resize((width * SMOOTH, height * SMOOTH), Image.Resampling.BILINEAR)
        self._image.paste(large, (x * SMOOTH, y * SMOOTH))

    def pixels(self) -> np.ndarray:
        """[height, width, 3] uint8."""
        return np.asarray(self._image.resize(self.size, Image.Resampling.BOX))


def _box(x: float, y: float, radius: float) -> list[float]:
    return [v * SMOOTH for v in (x - radius, y - radius, x + radius, y + radius)]
