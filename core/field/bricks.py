"""The order in which the entries of a grid lie in memory: bricks of 4 x 4 x 4, one after the other.

What is near in space is then near in memory. A row of a plain [n, n, n] array runs along z alone; rays, and the eight
nodes around a point, go all ways, and training waits for memory more than it computes (docs/training.md). The bricks at
the far sides may stick out of the grid: places there belong to no entry.

`brick_place` in core/kernels/types.py is the same order for kernels.
"""

import numpy as np
from torch import Tensor
from torch.nn import functional

BRICK = 4  # entries per axis


def bricks_along(n: int) -> int:
    """Bricks per axis of a grid of n entries per axis."""
    return -(-n // BRICK)


def places_in(n: int) -> int:
    """Length of an array that holds a grid of n entries per axis."""
    return (bricks_along(n) * BRICK) ** 3


def brick_places(ijk: np.ndarray, n: int) -> np.ndarray:
    """[m] int64: the places of entries [m, 3] of an [n, n, n] grid."""
    outer, inner = np.divmod(ijk.astype(np.int64), BRICK)
    return _flat(outer, bricks_along(n)) * BRICK**3 + _flat(inner, BRICK)


def to_bricks(grid: Tensor) -> Tensor:
    """[places, ...]: a grid [n, n, n, ...] in brick order; zero at places that belong to no entry."""
    n, b, rest = grid.shape[0], bricks_along(grid.shape[0]), grid.shape[3:]
    if b * BRICK > n:
        grid = functional.pad(grid, (0, 0) * len(rest) + (0, b * BRICK - n) * 3)
    bricks = grid.reshape(b, BRICK, b, BRICK, b, BRICK, *rest).permute(*_SWAP, *range(6, 6 + len(rest)))
    return bricks.reshape(-1, *rest)


def from_bricks(places: Tensor, n: int) -> Tensor:
    """[n, n, n, ...]: the grid that `to_bricks` made [places, ...] of."""
    b, rest = bricks_along(n), places.shape[1:]
    grid = places.reshape(b, b, b, BRICK, BRICK, BRICK, *rest).permute(*_SWAP_BACK, *range(6, 6 + len(rest)))
    return grid.reshape((b * BRICK,) * 3 + rest)[:n, :n, :n].contiguous()


_SWAP, _SWAP_BACK = (0, 2, 4, 1, 3, 5), (0, 3, 1, 4, 2, 5)


def _flat(ijk: np.ndarray, n: int) -> np.ndarray:
    return (ijk[:, 0] * n + ijk[:, 1]) * n + ijk[:, 2]
