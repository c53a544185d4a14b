"""What stands in for the picture where there are no cameras: some of the photos, named."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from core.capture_report.canvas import Canvas
from core.errors import InputError
from core.images import read_reduced

COLUMNS, SIDE_PX, GAP_PX, NAME_PX, MAX_SHOWN = 6, 170, 12, 26, 24
LONGEST_NAME = 18


def photos_picture(folder: Path, names: Sequence[str]) -> np.ndarray:
    """[h, w, 3] uint8: up to 24 photos, spread over all of them."""
    shown = names[:: max(1, -(-len(names) // MAX_SHOWN))]
    rows = max(1, -(-len(shown) // COLUMNS))
    across, down = SIDE_PX + GAP_PX, SIDE_PX + NAME_PX + GAP_PX
    canvas = Canvas(COLUMNS * across + GAP_PX, rows * down + GAP_PX)
    for index, name in enumerate(shown):
        row, column = divmod(index, COLUMNS)
        _show(canvas, GAP_PX + column * across, GAP_PX + row * down, folder, name)
    return canvas.pixels()


def _show(canvas: Canvas, x: int, y: int, folder: Path, name: str) -> None:
    """One photo, at the bottom of its cell, above its name."""
    try:
        photo = _over_white(read_reduced(folder / name, SIDE_PX))
        canvas.paste(x, y + SIDE_PX - photo.shape[0], photo)
    except InputError:
        canvas.text(x, y + SIDE_PX / 2, "cannot be decoded")
    short = name if len(name) <= LONGEST_NAME else f"...{name[3 - LONGEST_NAME :]}"
    canvas.text(x, y + SIDE_PX + NAME_PX / 2, short)


def _over_white(photo_u8: np.ndarray) -> np.ndarray:
    if photo_u8.shape[2] == 3:
        return photo_u8
    alpha = photo_u8[..., 3:] / 255.0
    return np.rint(photo_u8[..., :3] * alpha + 255.0 * (1.0 - alpha)).astype(np.uint8)
