"""A photo in the report's picture."""

from __future__ import annotations

from dataclasses import dataclass

from core.capture import View
from core.capture_report.canvas import PAPER, Canvas, Color

TRAIN: Color = (36, 92, 214)
HELD_OUT: Color = (232, 132, 12)
FLAGGED: Color = (206, 34, 50)


@dataclass(frozen=True)
class Dot:
    """Attributes:
    view: the photo.
    held_out: whether it is kept for measuring.
    flagged: whether it is blurred, or its exposure jumps.
    """

    view: View
    held_out: bool
    flagged: bool

    @property
    def color(self) -> Color:
        return HELD_OUT if self.held_out else TRAIN


def draw_dot(canvas: Canvas, x: float, y: float, dot: Dot, radius: float = 6.0) -> None:
    canvas.disc(x, y, radius, dot.color, PAPER)
    if dot.flagged:
        canvas.ring(x, y, radius + 3.5, FLAGGED, 2.0)
