"""Where in space the texels of a scene are."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from core.baked import BakedScene, Page
from core.conventions import is_opaque

MOST_TEXELS = 8_000_000  # more than a texture of 2048² can tell apart; a search tree on them takes a gigabyte
ON_EDGE = 1e-4  # in barycentric coordinates: the corners of patches are texel centres


@dataclass(frozen=True)
class Texels:
    """Texels that lie on a triangle on which some are opaque; those on an edge of two appear twice.

    Attributes:
        positions: float32 [n, 3], object frame.
        colors_u8: uint8 [n, 3], sRGB.
        opaque: [n] bool.
    """

    positions: np.ndarray
    colors_u8: np.ndarray
    opaque: np.ndarray


def texels_of(scene: BakedScene, most: int = MOST_TEXELS) -> tuple[Texels, list[np.ndarray]]:
    """The texels of all pages, and of each page the triangles [T] bool on which some texel is opaque.

    Of scenes with more texels than `most`, every second (third ...) in both directions is taken.
    """
    sizes = [_texel_corners(page) for page in scene.pages]
    total = sum(float(np.prod(high - low + 1, axis=-1).sum()) / 2 for low, high in sizes)
    stride = max(1, int(np.ceil(np.sqrt(total / most))))
    parts, shown = [], []
    for page in scene.pages:
        opaque = is_opaque(page.features_u8)
        visible = np.zeros(len(page.triangles), bool)
        for triangles, texels, positions in _on_triangles(page, stride):
            solid = opaque[texels[:, 1], texels[:, 0]]
            visible[triangles[solid]] = True
            on = visible[triangles]
            x, y = texels[on].T
            parts.append((positions[on], page.colors_u8[y, x], solid[on]))
        shown.append(visible)
    return Texels(*(np.concatenate(arrays) for arrays in zip(*parts, strict=True))), shown


def _texel_corners(page: Page) -> tuple[np.ndarray, np.ndarray]:
    """First and last texel (x, y), [T, 2] each, that a triangle touches."""
    height, width = page.features_u8.shape[:2]
    corners = page.texcoords[page.triangles] * np.array([width, height], np.float32)
    limit = np.array([width, height]) - 1
    low, high = (np.clip(np.floor(found), 0, limit).astype(np.int64) for found in (corners.min(1), corners.max(1)))
    return low, high


def _on_triangles(page: Page, stride: int) -> Iterator[tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """(triangle [n], texel (x, y) [n, 2], position float32 [n, 3]), for triangles of one extent in texels at a time."""
    height, width = page.features_u8.shape[:2]
    corners = page.texcoords[page.triangles].astype(np.float64) * (width, height)
    low, high = _texel_corners(page)
    extents, which = np.unique(high - low + 1, axis=0, return_inverse=True)
    for group, (columns, rows) in enumerate(extents):
        triangles = np.flatnonzero(which.ravel() == group)
        x, y = np.meshgrid(np.arange(0, columns, stride), np.arange(0, rows, stride))
        texels = low[triangles, None] + np.stack([x.ravel(), y.ravel()], -1)
        weights = _barycentric(texels + 0.5, corners[triangles])
        index, texel = np.nonzero((weights >= -ON_EDGE).all(-1))
        weights = weights[index, texel]
        vertices = page.positions[page.triangles[triangles[index]]]
        positions = np.einsum("nk,nkc->nc", weights.astype(np.float32), vertices)
        yield triangles[index], texels[index, texel], positions


def _barycentric(points: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """[T, n, 3] of points [T, n, 2] on triangles [T, 3, 2]; NaN where a triangle has no area."""
    origin, u, v = corners[:, :1], corners[:, 1:2] - corners[:, :1], corners[:, 2:] - corners[:, :1]
    offset = points - origin
    with np.errstate(divide="ignore", invalid="ignore"):
        area = _cross(u, v)
        second, third = _cross(offset, v) / area, _cross(u, offset) / area
    return np.stack([1 - second - third, second, third], -1)


def _cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    product: np.ndarray = a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
    return product
