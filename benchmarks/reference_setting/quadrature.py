"""Quadrature points: where rays meet the mesh (eq. 7 to 9, supplement G)."""

from dataclasses import dataclass

import torch
from torch import Tensor

from benchmarks.reference_setting.grid_mesh import NEIGHBOURS, TRIANGLE_NEIGHBOURS, TRIANGLES_AROUND, GridMesh

PARALLEL = 1e-9  # a ray as parallel to a plane as this never meets it
CELLS_AT_ONCE = 1 << 17  # bounds memory: 24 triangles are tried for each


@dataclass(frozen=True)
class Hits:
    """All hits of a batch of rays, sorted by ray and then by distance.

    Attributes:
        ray: [n], rank: [n], the hit's place along its ray.
        vertices: [n, 3] flat cells of the triangle's corners.
        weights: [n, 3] barycentric, without gradient (paper 3.1: gradients reach vertices through them alone).
        t: [n], distance along the ray.
    """

    ray: Tensor
    rank: Tensor
    vertices: Tensor
    weights: Tensor
    t: Tensor

    def points(self, mesh: GridMesh) -> Tensor:
        """[n, 3], differentiable with respect to the mesh's vertices."""
        return (self.weights[..., None] * mesh.vertex(self.vertices)).sum(1)


@torch.no_grad()
def intersections(
    mesh: GridMesh, origins: Tensor, directions: Tensor, keep: int, nonempty: Tensor | None = None
) -> Hits:
    """The nearest `keep` hits of each ray [R, 3]; only in cells that are `nonempty` ([P^3] bool), where given."""
    ray, cell, enter, leave = cells_along(origins, directions, mesh.cells)
    if nonempty is not None:
        open_cells = nonempty[mesh.flat(cell)]
        ray, cell, enter, leave = ray[open_cells], cell[open_cells], enter[open_cells], leave[open_cells]
    found = []
    for part in torch.arange(len(ray), device=ray.device).split(CELLS_AT_ONCE):
        o, d = origins[ray[part]], directions[ray[part]]
        pair, vertices, weights, t = _triangles_hit(mesh, cell[part], o, d, enter[part], leave[part])
        found.append((ray[part][pair], vertices, weights, t))
    if not found:
        nothing = torch.zeros(0, 3, device=ray.device)
        return Hits(ray, ray, nothing.long(), nothing, enter)
    return _nearest(*(torch.cat(parts) for parts in zip(*found, strict=True)), keep)


def cells_along(origins: Tensor, directions: Tensor, P: int) -> tuple[Tensor, Tensor, Tensor, Tensor]:
    """(ray [n], cell [n, 3], t where the ray enters [n] and leaves it [n]) of all cells that rays [R, 3] go through.

    The ray is cut at its 3 (P + 1) intersections with the grid's planes.
    """
    planes = torch.linspace(-1.0, 1.0, P + 1, device=origins.device)
    parallel = directions.abs() < PARALLEL
    safe = torch.where(parallel, torch.ones_like(directions), directions)
    t = (planes[:, None] - origins[:, None, :]) / safe[:, None, :]
    t = torch.where(parallel[:, None, :] | (t < 0), torch.inf, t).flatten(1)
    t = torch.cat([torch.zeros_like(t[:, :1]), t], 1).sort(1).values  # from the camera, which may be inside
    enter, leave = t[:, :-1], t[:, 1:]
    middle = origins[:, None, :] + 0.5 * (enter + leave)[..., None] * directions[:, None, :]
    valid = torch.isfinite(leave) & (leave > enter) & (middle.abs() < 1.0).all(-1)
    ray, place = valid.nonzero(as_tuple=True)
    cell = ((middle[ray, place] + 1.0) * (0.5 * P)).long().clamp(0, P - 1)
    return ray, cell, enter[ray, place], leave[ray, place]


def _triangles_hit(
    mesh: GridMesh, cell: Tensor, o: Tensor, d: Tensor, enter: Tensor, leave: Tensor
) -> tuple[Tensor, Tensor, Tensor, Tensor]:
    """(pair [m], vertices [m, 3], barycentric weights [m, 3], t [m]) of the hits within each cell's stretch of its ray.

    A quad lies within the block of its four cells, so each hit is found in exactly one of them.
    """
    device = cell.device
    neighbours = cell[:, None, :] + torch.from_numpy(NEIGHBOURS).to(device)
    index = mesh.flat(neighbours.clamp(0, mesh.cells - 1))
    corner = torch.from_numpy(TRIANGLE_NEIGHBOURS).to(device)
    v = mesh.vertex(index)[:, corner] - o[:, None, None, :]  # [n, 24, 3 corners, 3]
    v0, v1, v2 = v.unbind(2)
    ray = d[:, None, :].expand_as(v0)
    b = torch.stack([_triple(ray, v1, v2), _triple(ray, v2, v0), _triple(ray, v0, v1)], -1)
    total = b.sum(-1)
    t = _triple(v0, v1, v2) / total
    exists = mesh.inside(cell[:, None, None, :] + torch.from_numpy(TRIANGLES_AROUND).to(device)).all(-1)
    same_side = (b >= 0).all(-1) | (b <= 0).all(-1)
    hit = exists & same_side & (total != 0) & (t >= enter[:, None]) & (t < leave[:, None])
    pair, triangle = hit.nonzero(as_tuple=True)
    weights = b[pair, triangle] / total[pair, triangle, None]
    return pair, index[pair[:, None], corner[triangle]], weights, t[pair, triangle]


def _triple(a: Tensor, b: Tensor, c: Tensor) -> Tensor:
    return (a * torch.linalg.cross(b, c)).sum(-1)


def _nearest(ray: Tensor, vertices: Tensor, weights: Tensor, t: Tensor, keep: int) -> Hits:
    """Sorted hits, at most `keep` a ray."""
    order = t.argsort()
    order = order[ray[order].argsort(stable=True)]
    ray = ray[order]
    first = torch.searchsorted(ray, ray)
    rank = torch.arange(len(ray), device=ray.device) - first
    kept = rank < keep
    order = order[kept]
    return Hits(ray[kept], rank[kept], vertices[order], weights[order], t[order])
