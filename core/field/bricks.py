"""The order in which entries of a grid lie in memory: bricks of 4 x 4 x 4, one after the other.

What is near in space is then near in memory. A row of a plain [n, n, n] array runs along z alone; a ray, and the eight
nodes around a point, go all ways. Kernels wait for memory more than they compute (docs/training.md).

`core/kernels/types.py` has the same order for kernels.
"""

import numpy as np
import torch
from torch import Tensor
from torch.nn import functional

BRICK = 4  # entries per axis


def bricks_along(n: int) -> int:
    """Bricks per axis of a grid of n entries per axis; the last ones may stick out of it."""
    return -(-n // BRICK)


def brick_places(ijk: np.ndarray, n: int) -> np.ndarray:
    """[m] int64: the places in brick order of entries [m, 3] of an [n, n, n] grid."""
    outer, inner = np.divmod(ijk.astype(np.int64), BRICK)
    return _flat(outer, bricks_along(n)) * BRICK**3 + _flat(inner, BRICK)


def in_brick_order(mask: Tensor) -> Tensor:
    """[m] int32: the flat indices of the true entries of an [n, n, n] grid, in brick order."""
    n = mask.shape[0]
    b = bricks_along(n)
    padded = functional.pad(mask.to(torch.uint8), (0, b * BRICK - n) * 3)
    bricks = padded.reshape(b, BRICK, b, BRICK, b, BRICK).permute(0, 2, 4, 1, 3, 5)
    place = bricks.reshape(-1).nonzero()[:, 0].to(torch.int32)
    outer, inner = place // BRICK**3, place % BRICK**3
    x, y, z = (_digit(outer, axis, b) * BRICK + _digit(inner, axis, BRICK) for axis in range(3))
    return (x * n + y) * n + z


def _flat(ijk: np.ndarray, n: int) -> np.ndarray:
    return (ijk[:, 0] * n + ijk[:, 1]) * n + ijk[:, 2]


def _digit(flat: Tensor, axis: int, n: int) -> Tensor:
    """The index along an axis of flat indices into an [n, n, n] grid."""
    return flat // n ** (2 - axis) % n
