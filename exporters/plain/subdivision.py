"""Textured triangles as smaller triangles of one colour each, without those that fall into holes."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from core.baked import Page
from core.conventions import is_opaque

TRIANGLES_AT_ONCE = 1 << 15  # before they are divided; 0.2 GB at 8 pieces a side
MOST_SAMPLES = 4  # along a piece's side: 16 in all
SHOWN_FROM = 0.5  # of a piece's samples are opaque


@dataclass(frozen=True)
class Pieces:
    """Attributes:
    corners: float64 [n, 3, 3].
    colors: float64 [n, 3] in [0, 255], sRGB: the mean over what is opaque.
    """

    corners: np.ndarray
    colors: np.ndarray


def texels_of_a_side(page: Page) -> int:
    """How many texels' widths the longer side in x or y of a triangle is long, at least 1; the median."""
    corners = page.texcoords[page.triangles] * np.array(page.features_u8.shape[1::-1], np.float32)
    return max(1, round(float(np.median(np.ptp(corners, axis=1).max(-1)))))


def pieces_of(page: Page, positions: np.ndarray, sides: int) -> Iterator[Pieces]:
    """The page's triangles, some at a time, each divided into sides² equal ones, of which the shown are kept.

    Args:
        positions: [V, 3], of the page's vertices.
        sides: pieces along a side, at least 1.
    """
    opaque = is_opaque(page.features_u8)
    size = np.array(opaque.shape[::-1])
    texcoords = page.texcoords.astype(np.float64) * size
    weights = _pieces(sides)
    for first in range(0, len(page.triangles), TRIANGLES_AT_ONCE):
        triangles = page.triangles[first : first + TRIANGLES_AT_ONCE]
        at = (weights @ texcoords[triangles][:, None]).reshape(-1, 3, 2)
        colors, share = _looked_up(page, opaque, at)
        corners = (weights @ positions[triangles][:, None]).reshape(-1, 3, 3)
        shown = share >= SHOWN_FROM
        yield Pieces(corners[shown], colors[shown])


def _looked_up(page: Page, opaque: np.ndarray, corners: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(mean colour of what is opaque [n, 3], its share [n]) of triangles [n, 3, 2] in texels."""
    longest = float(np.abs(corners - np.roll(corners, 1, 1)).max(initial=1.0))
    samples = _pieces(int(np.clip(np.ceil(longest), 1, MOST_SAMPLES))).mean(1)
    height, width = opaque.shape
    x, y = np.moveaxis(np.floor(samples @ corners).astype(np.int64), -1, 0)
    x, y = np.clip(x, 0, width - 1), np.clip(y, 0, height - 1)
    there = opaque[y, x]
    total = np.einsum("nsc,ns->nc", page.colors_u8[y, x], there, dtype=np.float64)
    return total / np.maximum(there.sum(1), 1)[:, None], there.mean(1)


def _pieces(sides: int) -> np.ndarray:
    """[sides², 3, 3]: the corners of a triangle's pieces as weights of its own; pieces turn as it does."""
    found = []
    for i in range(sides):
        for j in range(sides - i):
            found.append([(i, j), (i + 1, j), (i, j + 1)])
            if i + j < sides - 1:
                found.append([(i + 1, j), (i + 1, j + 1), (i, j + 1)])
    second, third = np.moveaxis(np.array(found, np.float64) / sides, -1, 0)
    return np.stack([1.0 - second - third, second, third], -1)
