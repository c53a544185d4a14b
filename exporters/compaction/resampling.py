"""Integrals of patches over the texels of other sizes.

A patch of K texels a side looks up texel floor(a (K - 1) + 1/2) for a in [0, 1], so texel i covers an interval, the
outer ones half of one. A patch of fewer texels holds, for each, the mean over what its interval covers.
"""

from functools import lru_cache

import numpy as np

Size = tuple[int, int]  # height, width


def shrunk(values: np.ndarray, opaque: np.ndarray, size: Size) -> tuple[np.ndarray, np.ndarray]:
    """Patches [n, h, w, c] (float32) with opacity [n, h, w] at another size (h', w').

    Returns:
        means over the opaque part [n, h', w', c] (0 where there is none), opacity [n, h', w'].
    """
    sums = integrals(with_patches_last(values, opaque, 1), size).transpose(3, 0, 1, 2)
    solid = sums[..., -1] > 0.5 * cells(size)
    means = sums[..., :-1] / np.maximum(sums[..., -1:], 1e-6)
    return np.where(solid[..., None], means, 0), solid


def with_patches_last(values: np.ndarray, opaque: np.ndarray, more: int) -> np.ndarray:
    """float32 [h, w, c + more, n] of values [n, h, w, c], 0 in holes; the last channel is the opacity.

    In this order, sums and products run along memory.
    """
    solid = opaque.transpose(1, 2, 0)
    result = np.empty((*solid.shape[:2], values.shape[-1] + more, solid.shape[2]), np.float32)
    np.multiply(values.transpose(1, 2, 3, 0), solid[:, :, None], out=result[:, :, :-more])
    result[:, :, -1] = solid
    return result


def integrals(values: np.ndarray, size: Size) -> np.ndarray:
    """[h', w', c, n] of [h, w, c, n]: integrals over the texels of another size."""
    if size[0] * values.shape[1] > size[1] * values.shape[0]:  # first the axis that leaves less
        return _along_rows(_along_columns(values, size[1]), size[0])
    return _along_columns(_along_rows(values, size[0]), size[1])


@lru_cache(maxsize=256)
def cells(size: Size) -> np.ndarray:
    """[h', w'] the area of each texel."""
    height, width = (np.diff(_borders(side)) for side in size)
    return np.outer(height, width).astype(np.float32)


@lru_cache(maxsize=256)
def overlaps(few: int, many: int) -> np.ndarray:
    """[few, many] float32: the length of [0, 1] that texel j of `few` and texel i of `many` share."""
    low = np.maximum(_borders(few)[:-1, None], _borders(many)[None, :-1])
    high = np.minimum(_borders(few)[1:, None], _borders(many)[None, 1:])
    return np.maximum(high - low, 0.0).astype(np.float32)


def _borders(side: int) -> np.ndarray:
    """[side + 1]: where the texels begin and the last one ends."""
    if side == 1:
        return np.array([0.0, 1.0])
    return np.clip((np.arange(side + 1) - 0.5) / (side - 1), 0.0, 1.0)


def _along_rows(values: np.ndarray, height: int) -> np.ndarray:
    before = values.shape
    sums: np.ndarray = overlaps(height, before[0]) @ values.reshape(before[0], -1)
    return sums.reshape(height, *before[1:])


def _along_columns(values: np.ndarray, width: int) -> np.ndarray:
    height, before, *rest = values.shape
    sums: np.ndarray = overlaps(width, before) @ values.reshape(height, before, -1)
    return sums.reshape(height, width, *rest)
