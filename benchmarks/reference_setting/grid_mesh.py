"""The mesh of paper 3.1: a vertex in each cell of a P^3 grid over the cube [-1, 1]^3, a quad across each grid edge."""

from itertools import product

import numpy as np
import torch
from torch import Tensor, nn

NEIGHBOURS = np.array(list(product((-1, 0, 1), repeat=3)))  # of a cell, itself included


def _quads_around() -> np.ndarray:
    """[12, 4, 3]: the quads that use a cell's vertex, as the offsets of their four cells, corners 00, 01, 10, 11."""
    quads = []
    for axis in range(3):
        b, c = (other for other in range(3) if other != axis)
        for low_b, low_c in product((-1, 0), repeat=2):
            corners = np.zeros((4, 3), np.int64)
            corners[:, b], corners[:, c] = low_b + np.array([0, 0, 1, 1]), low_c + np.array([0, 1, 0, 1])
            quads.append(corners)
    return np.array(quads)


QUADS_AROUND = _quads_around()
# A quad's two triangles share the diagonal from corner 00 to corner 11.
TRIANGLES_OF_QUAD = np.array([[0, 1, 3], [0, 2, 3]])
# [24, 3, 3]: the triangles that use a cell's vertex, as cell offsets, and [24, 3] as places among NEIGHBOURS.
TRIANGLES_AROUND = QUADS_AROUND[:, TRIANGLES_OF_QUAD].reshape(-1, 3, 3)
TRIANGLE_NEIGHBOURS = (TRIANGLES_AROUND + 1) @ np.array([9, 3, 1])


class GridMesh(nn.Module):
    """The vertices: `offsets` [P^3, 3] in cells from the cells' centres, within [-0.5, 0.5]."""

    def __init__(self, cells: int) -> None:
        super().__init__()
        self.cells = cells
        self.offsets = nn.Parameter(torch.zeros(cells**3, 3))

    def flat(self, cell: Tensor) -> Tensor:
        """Flat index of cells [..., 3]."""
        return (cell[..., 0] * self.cells + cell[..., 1]) * self.cells + cell[..., 2]

    def vertex(self, index: Tensor) -> Tensor:
        """Positions [..., 3] of the vertices of cells given by flat index [...]; differentiable."""
        P = self.cells
        ijk = torch.stack([index // (P * P), index // P % P, index % P], -1)
        return (ijk + 0.5 + self.offsets[index]) * (2.0 / P) - 1.0

    def inside(self, cell: Tensor) -> Tensor:
        """Whether cells [..., 3] are cells of the grid."""
        return ((cell >= 0) & (cell < self.cells)).all(-1)

    def quads(self, wanted: Tensor) -> Tensor:
        """[Q, 4] flat cells of all quads between four `wanted` cells [P^3] (bool)."""
        P = self.cells
        index = torch.arange(P**3, device=wanted.device).reshape(P, P, P)
        solid = wanted.reshape(P, P, P)
        found = []
        for axis in range(3):
            i, s = index.movedim(axis, 0), solid.movedim(axis, 0)
            corners = [i[:, b : P - 1 + b, c : P - 1 + c] for b, c in ((0, 0), (0, 1), (1, 0), (1, 1))]
            kept = [s[:, b : P - 1 + b, c : P - 1 + c] for b, c in ((0, 0), (0, 1), (1, 0), (1, 1))]
            found.append(torch.stack(corners, -1)[torch.stack(kept).all(0)])
        return torch.cat(found)
