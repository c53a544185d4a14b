"""Trilinear lookup in a grid of nodes over the cube [-1, 1]^3."""

import torch
from torch import Tensor


def trilinear(grid: Tensor, points: Tensor) -> Tensor:
    """Values [k, c] of a grid [n, n, n, c] at points [k, 3] of the cube; differentiable in both.

    The outermost nodes lie on the cube's faces.
    """
    n = grid.shape[0]
    place = (points + 1.0) * (n - 1) / 2.0
    low = place.detach().floor().long().clamp(0, n - 2)
    f = place - low
    total = torch.zeros(len(points), grid.shape[3], dtype=grid.dtype)
    for dx in (0, 1):
        for dy in (0, 1):
            for dz in (0, 1):
                wx, wy, wz = (f[:, a] if d else 1.0 - f[:, a] for a, d in enumerate((dx, dy, dz)))
                corner = grid[low[:, 0] + dx, low[:, 1] + dy, low[:, 2] + dz]
                total = total + (wx * wy * wz)[:, None] * corner
    return total
