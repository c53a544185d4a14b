"""Runs of rows of an array, each as one item that is copied as a whole.

Index arithmetic is done once a run instead of once a texel: patches of 24² texels come off a page twenty times as fast
as texel by texel, and out of an array of patches sixty times as fast.
"""

import numpy as np


def windows(rows: np.ndarray, length: int) -> np.ndarray:
    """[T - length + 1] items of `length` following rows each of uint8 rows [T, c]; they overlap.

    Shares memory with `rows`, which must be contiguous. What is written through it must not overlap.
    """
    count, channels = rows.shape
    return np.ndarray(
        (max(count - length + 1, 0),), np.dtype((np.void, length * channels)), rows.data, strides=(channels,)
    )


def as_items(runs: np.ndarray, axes: int) -> np.ndarray:
    """uint8 runs [...] with all but the first `axes` axes made one item, to be assigned to windows."""
    shape = runs.shape[:axes]
    whole = np.ascontiguousarray(runs).reshape(*shape, -1)
    return whole.view(np.dtype((np.void, whole.shape[-1])))[..., 0]


def as_bytes(items: np.ndarray) -> np.ndarray:
    """uint8 [..., b] of items [...] that indexing windows has given."""
    return np.ascontiguousarray(items)[..., None].view(np.uint8)
