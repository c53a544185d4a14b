"""Patches whose resolution follows what their texels hold.

Fewer texels take fewer bits and show another colour: the least of error + slope * bits is chosen for each patch
(Lagrangian rate-distortion optimisation).

A patch keeps its proportions, or takes one texel along an axis. With every pair of sides to choose from, scene.web.glb
has 0.3 % (lego_100) to 1.2 % (fox) fewer bytes and the search takes five times as long.

Most patches of trained scenes stay as large as they are, which some channels tell (`best_sizes`).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from exporters.compaction.resampling import Size, cells, integrals, with_patches_last

# Channels that are looked at first. With 1, 8 % of lego_100's patches have to be looked at again, with 2, 5 %.
LEADING = 2
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


def best_sizes(
    y: np.ndarray,
    opaque: np.ndarray,
    most: float,
    hole_cost: float,
    weight: np.ndarray,
    trade: Trade,
    channels: Sequence[int] = (0, 1),
) -> np.ndarray:
    """int64 [n, 2]: what `size_options(y, opaque, most, hole_cost).best(weight, trade)` chooses.

    Where patches may stay as they are, without any error, a size that loses to that on some channels loses on all of
    them, since no channel's error is below 0. So a few channels, best those that vary most, rule out most of the
    patches, and holes alone most of those that are cut.
    """
    size = opaque.shape[1:]
    best = np.tile(np.array(size), (len(opaque), 1))
    whole = opaque.all((1, 2))
    for some, few in ((np.flatnonzero(whole), list(channels)), (np.flatnonzero(~whole), [])):
        if most >= 1 and len(some):
            leading = np.stack([picked(y[..., c], some) for c in few], -1) if few else np.empty((len(some), *size, 0))
            options = size_options(leading, picked(opaque, some), most, hole_cost)
            some = some[(options.best(weight[some], trade)[0] != size).any(1)]
        if len(some):
            options = size_options(picked(y, some), picked(opaque, some), most, hole_cost)
            best[some] = options.best(weight[some], trade)[0]
    return best


def picked(values: np.ndarray, numbers: np.ndarray) -> np.ndarray:
    """values[numbers]; values themselves where these are all, in order."""
    return values if len(numbers) == len(values) else values[numbers]


def size_options(y: np.ndarray, opaque: np.ndarray, most: float, hole_cost: float) -> SizeOptions:
    """What could be done with patches of one size.

    Args:
        y: float32 [n, h, w, 8], features in coordinates where distances are distances of colours.
        opaque: bool [n, h, w].
        most: largest side as a share of the patch's own.
        hole_cost: squared error where a hole is filled or made; infinite: holes stay where they are, and no patch is
            left out.
    """
    patches = _WholePatches(y) if opaque.all() else _CutPatches(y, opaque, hole_cost)
    count, height, width = opaque.shape
    choices = _pairs(sides(height, most), sides(width, most))
    found = [(size, *patches.error_and_texels(size)) for size in choices if size != (height, width)]
    if choices[-1] == (height, width):  # the patch as it is
        found.append(((height, width), np.zeros(count, np.float32), opaque.sum((1, 2), dtype=np.float32)))
    sizes, errors, texels = zip(*found, strict=True)
    if np.isinf(hole_cost):  # what is lost by the largest size allowed cannot be helped
        errors = (*errors[:-1], np.where(np.isfinite(errors[-1]), errors[-1], 0))
    else:
        sizes, texels = ((0, 0), *sizes), (np.zeros(count, np.float32), *texels)
        errors = (hole_cost * patches.covered() + errors[-1], *errors)
    return SizeOptions(np.array(sizes), np.stack(errors) - errors[-1], np.stack(texels))


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


class _CutPatches:
    """Patches with holes.

    Args: as of `size_options`.
    """

    def __init__(self, y: np.ndarray, opaque: np.ndarray, hole_cost: float) -> None:
        self._moments = with_patches_last(y, opaque, 2)  # [h, w, c + 2, n]: y, its square, 1; 0 in holes
        np.square(self._moments[:, :, :-2]).sum(2, out=self._moments[:, :, -2])
        self._hole_cost = hole_cost

    def covered(self) -> np.ndarray:
        """[n] the share that is opaque."""
        covered: np.ndarray = integrals(self._moments[:, :, -1:], (1, 1))[0, 0, 0]
        return covered

    def error_and_texels(self, size: Size) -> tuple[np.ndarray, np.ndarray]:
        """(squared error [n], opaque texels [n]) at a size."""
        sums = integrals(self._moments, size)
        covered, whole = sums[:, :, -1], cells(size)[..., None]
        solid = covered > 0.5 * whole
        spread = sums[:, :, -2] - np.square(sums[:, :, :-2]).sum(2) / np.maximum(covered, 1e-6)
        error = (np.maximum(spread, 0.0) * solid).sum((0, 1))
        moved = np.where(solid, whole - covered, covered).sum((0, 1))
        error += np.where(moved > 1e-4, np.inf, 0.0) if np.isinf(self._hole_cost) else self._hole_cost * moved
        return error.astype(np.float32), solid.sum((0, 1), dtype=np.float32)


class _WholePatches:
    """Patches without holes: what `_CutPatches` says of them, from fewer sums.

    A mean takes from the variance what it explains, so squares are integrated once for all sizes.
    """

    def __init__(self, y: np.ndarray) -> None:
        self._values = np.ascontiguousarray(y.transpose(1, 2, 3, 0))
        self._values -= integrals(self._values, (1, 1))  # so that squares are small, and float32 does
        self._variance = _weighted_squares(self._values, cells(self._values.shape[:2]))

    def covered(self) -> np.ndarray:
        """[n] the share that is opaque."""
        return np.ones(self._values.shape[-1], np.float32)

    def error_and_texels(self, size: Size) -> tuple[np.ndarray, np.ndarray]:
        """(squared error [n], opaque texels [n]) at a size."""
        explained = _weighted_squares(integrals(self._values, size), 1 / cells(size))
        return np.maximum(self._variance - explained, 0.0), np.full(len(explained), size[0] * size[1], np.float32)


def _weighted_squares(values: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """[n] float32 of [h, w, c, n] and [h, w]: squares, weighted and summed."""
    squares = np.square(values).reshape(-1, values.shape[-1])
    sums: np.ndarray = np.repeat(weights.ravel(), values.shape[2]) @ squares
    return sums
