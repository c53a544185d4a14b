"""Texture coordinates for any heap of triangles: two that share an edge get a square patch.

What charts need is lacking: a surface. On lego_400, decimated to 41,000 triangles, xatlas takes 23 s of processor time
for 28,000 charts, that is, 1.5 triangles each. Patches of two take no time, waste no texel, and hardly distort quads.

Patches of a size are ordered along a space-filling curve, so that what mip maps mix up looks alike.
"""

from dataclasses import dataclass

import numpy as np

SMALLEST_PATCH_PX, LARGEST_PATCH_PX = 2, 64
_CORNERS = np.array([[0, 0], [1, 0], [0, 1], [1, 1]])  # of a patch, (x, y)
_UPPER, _LOWER = np.array([0, 1, 2]), np.array([2, 1, 3])  # its triangles
_SEARCH_STEPS = 40
_MORTON_BITS = 10


@dataclass(frozen=True)
class Quilt:
    """Patches on a square texture. A patch's corners are texel centres.

    Attributes:
        size_px: side of the texture.
        corners: int64 [n, 4], vertices at a patch's (left, top), (right, top), (left, bottom), (right, bottom); the two
            triangles share the second and the third. A triangle alone has no fourth: it is -1.
        patch_px: int64 [n], side, texels.
        left_top_px: int64 [n, 2], (x, y) of the patch's first texel.
    """

    size_px: int
    corners: np.ndarray
    patch_px: np.ndarray
    left_top_px: np.ndarray

    def texcoords(self) -> np.ndarray:
        """float64 [n, 4, 2] of the corners, (0, 0) at the texture's top left corner."""
        steps = _CORNERS * (self.patch_px[:, None, None] - 1)
        return (self.left_top_px[:, None] + steps + 0.5) / self.size_px

    def triangles(self) -> np.ndarray:
        """int64 [t, 3] that index the patches' corners, 4 n of them."""
        first = 4 * np.arange(len(self.corners))[:, None]
        return np.concatenate([first + _UPPER, (first + _LOWER)[self.corners[:, 3] >= 0]])

    def places(self, positions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Texels (x, y) [m, 2] of all patches, and their places float32 [m, 3] on the triangles; once each."""
        fourth = np.where(self.corners[:, 3] >= 0, self.corners[:, 3], self.corners[:, 0])
        a, b, c, d = (positions[index] for index in (*self.corners[:, :3].T, fourth))
        texels, places = [], []
        for side in np.unique(self.patch_px):
            which = np.flatnonzero(self.patch_px == side)
            x, y = (axis.ravel() for axis in np.meshgrid(np.arange(side), np.arange(side)))
            u, v = (axis[None, :, None] / (side - 1) for axis in (x, y))
            upper = a[which, None] * (1 - u - v) + b[which, None] * u + c[which, None] * v
            lower = d[which, None] * (u + v - 1) + c[which, None] * (1 - u) + b[which, None] * (1 - v)
            # Beyond its long edge, a triangle alone is continued by its mirror image.
            places.append(np.where(u + v <= 1, upper, lower).reshape(-1, 3).astype(np.float32))
            texels.append((self.left_top_px[which, None] + np.stack([x, y], -1)).reshape(-1, 2))
        return np.concatenate(texels), np.concatenate(places)


def quilt(positions: np.ndarray, triangles: np.ndarray, size_px: int) -> Quilt:
    """Patches for triangles int64 [T, 3], as large as fit, sides in proportion to edges."""
    corners = _paired(positions, triangles)
    lengths = _longest_sides(positions, corners)
    patch_px = _fitting_sides(lengths, size_px)
    centres = positions[corners[:, 1]] + positions[corners[:, 2]]
    order = np.lexsort([_morton(centres), -patch_px])
    corners, patch_px = corners[order], patch_px[order]
    return Quilt(size_px, corners, patch_px, _shelves(patch_px, size_px))


def _paired(positions: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """[n, 4] corners: greedy pairs, longest shared edges first."""
    edges = np.sort(np.stack([triangles[:, [1, 2]], triangles[:, [2, 0]], triangles[:, [0, 1]]], 1), -1)
    lengths = np.linalg.norm(positions[edges[..., 0]] - positions[edges[..., 1]], axis=-1)
    flat = edges.reshape(-1, 2)
    order = np.lexsort([flat[:, 1], flat[:, 0], -lengths.ravel()])  # equal edges are neighbours, longest first
    same = (flat[order[1:]] == flat[order[:-1]]).all(-1)
    partner = np.full(len(triangles), -1)
    opposite = np.zeros(len(triangles), np.int64)
    for first, second in zip(order[:-1][same].tolist(), order[1:][same].tolist(), strict=True):
        one, other = first // 3, second // 3
        if partner[one] < 0 and partner[other] < 0:
            partner[one], partner[other] = other, one
            opposite[one], opposite[other] = first % 3, second % 3
    opposite = np.where(partner < 0, lengths.argmax(1), opposite)  # alone: across the longest edge
    heads = np.flatnonzero((partner < 0) | (partner > np.arange(len(triangles))))
    apex, left, right = (triangles[heads, (opposite[heads] + step) % 3] for step in range(3))
    mate = partner[heads]
    fourth = np.where(mate < 0, -1, triangles[mate, opposite[mate]])
    return np.stack([apex, left, right, fourth], -1)


def _longest_sides(positions: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """[n]: longest of a patch's four sides, in space."""
    fourth = np.where(corners[:, 3] >= 0, corners[:, 3], corners[:, 0])
    a, b, c, d = (positions[index] for index in (*corners[:, :3].T, fourth))
    return np.max([np.linalg.norm(p - q, axis=-1) for p, q in ((a, b), (a, c), (d, b), (d, c))], axis=0)


def _fitting_sides(lengths: np.ndarray, size_px: int) -> np.ndarray:
    """Sides in texels, the densest that still fit (bisection)."""
    low, high = 0.0, LARGEST_PATCH_PX / max(float(np.median(lengths)), 1e-30)
    for _ in range(_SEARCH_STEPS):
        density = (low + high) / 2
        if _height(_sides(lengths, density), size_px) <= size_px:
            low = density
        else:
            high = density
    return _sides(lengths, low)


def _sides(lengths: np.ndarray, density: float) -> np.ndarray:
    return np.clip(np.rint(lengths * density) + 1, SMALLEST_PATCH_PX, LARGEST_PATCH_PX).astype(np.int64)


def _height(patch_px: np.ndarray, size_px: int) -> int:
    """Of all shelves, each of patches of one size."""
    sides, counts = np.unique(patch_px, return_counts=True)
    return int((-(-counts // (size_px // sides)) * sides).sum())


def _shelves(patch_px: np.ndarray, size_px: int) -> np.ndarray:
    """[n, 2] of patches in order of their size."""
    left_top = np.zeros((len(patch_px), 2), np.int64)
    top = 0
    for side in np.unique(patch_px)[::-1]:
        which = np.flatnonzero(patch_px == side)
        per_shelf = size_px // side
        shelf, place = np.divmod(np.arange(len(which)), per_shelf)
        left_top[which] = np.stack([place * side, top + shelf * side], -1)
        top += (int(shelf[-1]) + 1) * int(side)
    return left_top


def _morton(points: np.ndarray) -> np.ndarray:
    """[n] int64: places along a space-filling curve (Z-order)."""
    low, high = points.min(0), points.max(0)
    cells = ((points - low) / np.maximum(high - low, 1e-30) * (2**_MORTON_BITS - 1)).astype(np.int64)
    code = np.zeros(len(points), np.int64)
    for bit in range(_MORTON_BITS):
        for axis in range(3):
            code |= ((cells[:, axis] >> bit) & 1) << (3 * bit + axis)
    return code
