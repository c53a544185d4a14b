"""Patches whose resolution follows what their texels hold.

A patch of K texels a side looks up texel floor(a (K - 1) + 1/2) for a in [0, 1], so texel i covers an interval, the
outer ones half of one. A patch of fewer texels holds, for each, the mean over what its interval covers. Fewer texels
take fewer bits and show another colour: the least of error + slope * bits is chosen for each patch
(Lagrangian rate-distortion optimisation).

A patch keeps its proportions, or takes one texel along an axis. With every pair of sides to choose from, scene.web.glb
has 0.3 % (lego_100) to 1.2 % (fox) fewer bytes and the search takes five times as long.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

BITS_A_QUAD = 110.0  # four vertices and two triangles, compressed; measured


@dataclass(frozen=True)
class Trade:
    """What error and bytes are worth to each other.

    Attributes:
        slope: squared error of colour, times the share of the patch, that a bit is worth.
        bits_a_texel: of an opaque texel, compressed.
    """

    slope: float
    bits_a_texel: float


@dataclass(frozen=True)
class SizeOptions:
    """What each size that some patches could have would cost.

    Attributes:
        sizes: int64 [o, 2]: (height, width); the last is the largest. (0, 0), if there, is to leave the patch out.
        errors: float32 [o, n]: squared error of colour (sum over RGB, integral over the patch's unit square) beyond
            that of the largest size; infinite where the size is not allowed.
        texels: float32 [o, n]: opaque ones.
    """

    sizes: np.ndarray
    errors: np.ndarray
    texels: np.ndarray

    def best(self, weight: np.ndarray, trade: Trade) -> tuple[np.ndarray, np.ndarray]:
        """(sizes [n, 2], errors [n]) of least cost.

        Args:
            weight: [n], each patch's share of the surface, mean 1.
        """
        bits = trade.bits_a_texel * self.texels + BITS_A_QUAD * (self.sizes[:, :1] > 0)
        best = (self.errors * weight.astype(np.float32) + np.float32(trade.slope) * bits).argmin(0)
        return self.sizes[best], self.errors[best, np.arange(len(best))]


def size_options(y: np.ndarray, opaque: np.ndarray, most: float, hole_cost: float) -> SizeOptions:
    """What could be done with patches of one size.

    Args:
        y: float32 [n, h, w, 8], features in coordinates where distances are distances of colours.
        opaque: bool [n, h, w].
        most: largest side as a share of the patch's own.
        hole_cost: squared error where a hole is filled or made; infinite: holes stay where they are, and no patch is
            left out.
    """
    moments = _moments(y, opaque)
    count, height, width = opaque.shape
    choices = _pairs(sides(height, most), sides(width, most))
    found = [
        (size, *_error_and_texels(_sums(moments, size), size, hole_cost)) for size in choices if size != (height, width)
    ]
    if choices[-1] == (height, width):  # the patch as it is
        found.append(((height, width), np.zeros(count, np.float32), opaque.sum((1, 2), dtype=np.float32)))
    sizes, errors, texels = zip(*found, strict=True)
    if np.isinf(hole_cost):  # what is lost by the largest size allowed cannot be helped
        errors = (*errors[:-1], np.where(np.isfinite(errors[-1]), errors[-1], 0))
    else:
        sizes, texels = ((0, 0), *sizes), (np.zeros(count, np.float32), *texels)
        left_out = hole_cost * _sums(moments[:, :, -1:], (1, 1))[0, 0, 0]
        errors = (left_out + errors[-1], *errors)
    return SizeOptions(np.array(sizes), np.stack(errors) - errors[-1], np.stack(texels))


def shrunk(values: np.ndarray, opaque: np.ndarray, size: tuple[int, int]) -> tuple[np.ndarray, np.ndarray]:
    """Patches [n, h, w, c] (float32) with opacity [n, h, w] at another size (h', w').

    Returns:
        means over the opaque part [n, h', w', c] (0 where there is none), opacity [n, h', w'].
    """
    sums = _sums(_with_patches_last(values, opaque, 1), size).transpose(3, 0, 1, 2)
    solid = sums[..., -1] > 0.5 * _cells(size)
    means = sums[..., :-1] / np.maximum(sums[..., -1:], 1e-6)
    return np.where(solid[..., None], means, 0), solid


def sides(side: int, most: float) -> list[int]:
    """Numbers of texels to choose from in place of `side`, rising to the largest."""
    largest = side if most >= 1 else min(side, max(2, round(side * most)))
    choices = {1, 2, 3, *(round(largest * share) for share in (0.25, 0.5, 0.75)), largest}
    return sorted(choice for choice in choices if 1 <= choice <= largest)


def _pairs(heights: list[int], widths: list[int]) -> list[tuple[int, int]]:
    """Sizes in proportion, and those of one texel along an axis; the last is the largest."""
    count, largest = max(len(heights), len(widths)), (heights[-1], widths[-1])
    steps = [index / max(count - 1, 1) for index in range(count)]
    even = {(heights[round(step * (len(heights) - 1))], widths[round(step * (len(widths) - 1))]) for step in steps}
    return [*sorted((even | {(heights[-1], 1), (1, widths[-1])}) - {largest}), largest]


@lru_cache(maxsize=256)
def overlaps(few: int, many: int) -> np.ndarray:
    """[few, many] float32: the length of [0, 1] that texel j of `few` and texel i of `many` share."""
    low = np.maximum(_starts(few)[:-1, None], _starts(many)[None, :-1])
    high = np.minimum(_starts(few)[1:, None], _starts(many)[None, 1:])
    return np.maximum(high - low, 0.0).astype(np.float32)


def _starts(side: int) -> np.ndarray:
    """[side + 1]: where the texels begin and the last one ends."""
    if side == 1:
        return np.array([0.0, 1.0])
    return np.clip((np.arange(side + 1) - 0.5) / (side - 1), 0.0, 1.0)


def _moments(y: np.ndarray, opaque: np.ndarray) -> np.ndarray:
    """[h, w, 8 + 2, n]: of what is opaque the features, their square, and 1."""
    moments = _with_patches_last(y, opaque, 2)
    np.square(moments[:, :, :-2]).sum(2, out=moments[:, :, -2])
    return moments


def _with_patches_last(values: np.ndarray, opaque: np.ndarray, more: int) -> np.ndarray:
    """float32 [h, w, c + more, n] of values [n, h, w, c], 0 in holes; the last channel is the opacity.

    In this order, sums and products run along memory.
    """
    solid = opaque.transpose(1, 2, 0)
    result = np.empty((*solid.shape[:2], values.shape[-1] + more, solid.shape[2]), np.float32)
    np.multiply(values.transpose(1, 2, 3, 0), solid[:, :, None], out=result[:, :, :-more])
    result[:, :, -1] = solid
    return result


def _error_and_texels(sums: np.ndarray, size: tuple[int, int], hole_cost: float) -> tuple[np.ndarray, np.ndarray]:
    """(squared error [n], opaque texels [n]) of patches' sums [h', w', 10, n]."""
    covered, whole = sums[:, :, -1], _cells(size)[..., None]
    solid = covered > 0.5 * whole
    spread = sums[:, :, -2] - np.square(sums[:, :, :-2]).sum(2) / np.maximum(covered, 1e-6)
    error = (np.maximum(spread, 0.0) * solid).sum((0, 1))
    moved = np.where(solid, whole - covered, covered).sum((0, 1))
    error += np.where(moved > 1e-4, np.inf, 0.0) if np.isinf(hole_cost) else hole_cost * moved
    return error.astype(np.float32), solid.sum((0, 1), dtype=np.float32)


def _sums(values: np.ndarray, size: tuple[int, int]) -> np.ndarray:
    """[h', w', c, n] of [h, w, c, n]: integrals over the texels of another size."""
    if size[0] * values.shape[1] > size[1] * values.shape[0]:  # first the axis that leaves less
        return _along_rows(_along_columns(values, size[1]), size[0])
    return _along_columns(_along_rows(values, size[0]), size[1])


def _along_rows(values: np.ndarray, height: int) -> np.ndarray:
    before = values.shape
    sums: np.ndarray = overlaps(height, before[0]) @ values.reshape(before[0], -1)
    return sums.reshape(height, *before[1:])


def _along_columns(values: np.ndarray, width: int) -> np.ndarray:
    height, before, *rest = values.shape
    sums: np.ndarray = overlaps(width, before) @ values.reshape(height, before, -1)
    return sums.reshape(height, width, *rest)


def _cells(size: tuple[int, int]) -> np.ndarray:
    """[h', w'] the area of each texel."""
    height, width = (np.diff(_starts(side)) for side in size)
    return np.outer(height, width).astype(np.float32)
