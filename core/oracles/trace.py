"""A ray's hits on a quad mesh by trying every triangle of every quad."""

from dataclasses import dataclass

import torch
from torch import Tensor

# The quad's two triangles, as corners of 00, 01, 10, 11; they share the diagonal from 00 to 11.
TRIANGLES = ((0, 1, 3), (0, 2, 3))
CORNER_AB = torch.tensor([[0.0, 0.0], [0.0, 1.0], [1.0, 0.0], [1.0, 1.0]], dtype=torch.float64)


@dataclass(frozen=True)
class RayHits:
    """Hits front to back: quad [k] int64, triangle [k] (0 or 1), t [k], ab [k, 2] and weights [k, 3] of the triangle's
    corners; the smallest weight tells how far inside the hit is."""

    quad: Tensor
    triangle: Tensor
    t: Tensor
    ab: Tensor
    weights: Tensor


def trace(
    vertices: Tensor, quads: Tensor, origin: Tensor, direction: Tensor, *, near: float = 0.0, margin: float = 0.0
) -> RayHits:
    """All hits of one ray beyond `near`.

    Solves v0 + beta (vm - v0) + gamma (v3 - v0) = o + t d by Cramer's rule (Moeller and Trumbore 1997).

    Args:
        vertices: [V, 3] float64. quads: [Q, 4] int64.
        margin: hits whose weights are as low as -margin count, too.
    """
    found = []
    for index, corners in enumerate(TRIANGLES):
        v0, vm, v3 = (vertices[quads[:, corner]] for corner in corners)
        edge_m, edge_3, away = vm - v0, v3 - v0, origin - v0
        p = torch.linalg.cross(direction.expand_as(edge_3), edge_3)
        q = torch.linalg.cross(away, edge_m)
        determinant = (edge_m * p).sum(-1)
        beta, gamma = (away * p).sum(-1) / determinant, (q * direction).sum(-1) / determinant
        t = (edge_3 * q).sum(-1) / determinant
        weights = torch.stack([1.0 - beta - gamma, beta, gamma], -1)
        hit = (determinant != 0.0) & (weights >= -margin).all(-1) & (t > near)
        ab = weights @ CORNER_AB[list(corners)]
        kept = hit.nonzero()[:, 0]
        found.append((kept, torch.full_like(kept, index), t[kept], ab[kept], weights[kept]))
    quad, triangle, t, ab, weights = (torch.cat(parts) for parts in zip(*found, strict=True))
    order = torch.argsort(t, stable=True)
    return RayHits(quad[order], triangle[order], t[order], ab[order], weights[order])
