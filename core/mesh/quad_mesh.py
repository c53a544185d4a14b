"""The quad mesh (paper 3.1): one vertex per kept cell of a P^3 grid, one quad per grid edge between four kept cells."""

from dataclasses import dataclass, replace

import numpy as np
import torch
import warp as wp
from torch import Tensor
from torch.nn import functional

from core.errors import TrainingFailed
from core.kernels.launch import launch
from core.kernels.trace import QuadMesh as KernelMesh
from core.kernels.trace import bound_quads

# A vertex may go this far from its cell's centre, in cells: within the cell, so that rays find every hit.
VERTEX_REACH = 0.49
CORNERS = 4
# Empty space is skipped in blocks of at most this many cells to each side.
FARTHEST = 16


@dataclass(frozen=True)
class QuadMesh:
    """A mesh in the cube's frame.

    Attributes:
        cells: P, per axis.
        kept: [V] int64, the flat index of each vertex's cell.
        vertices: [V, 3] float32 tensor, trained in place.
        quads: [Q, 4] int32, vertices at the corners 00, 01, 10, 11; the diagonal runs from 00 to 11.
    """

    cells: int
    kept: np.ndarray
    vertices: Tensor
    quads: np.ndarray

    @property
    def cell_size(self) -> float:
        return 2.0 / self.cells

    def centres(self) -> np.ndarray:
        """[V, 3] float32, the cells' centres."""
        ijk = np.stack(np.unravel_index(self.kept, (self.cells,) * 3), -1)
        return ((ijk + 0.5) * self.cell_size - 1.0).astype(np.float32)

    def with_quads(self, keep: np.ndarray) -> "QuadMesh":
        """The mesh with some of its quads, [Q] bool."""
        return replace(self, quads=np.ascontiguousarray(self.quads[keep]))

    def kernel_mesh(self, device: str) -> KernelMesh:
        """The mesh as kernels read it: each cell with the quads that use its vertex."""
        corner = self.quads.reshape(-1)
        order = np.argsort(corner, kind="stable")
        start = np.searchsorted(corner[order], np.arange(len(self.kept) + 1))
        slots = -_distance_to(self.kept, self.cells)
        slots[self.kept] = np.arange(len(self.kept))
        mesh = KernelMesh()
        mesh.cells = self.cells
        mesh.cell_slot = wp.array(slots, dtype=wp.int32, device=device)
        mesh.slot_start = wp.array(start.astype(np.int32), dtype=wp.int32, device=device)
        mesh.slot_quads = wp.array((order // CORNERS).astype(np.int32), dtype=wp.int32, device=device)
        mesh.quads = wp.array(self.quads, dtype=wp.vec4i, device=device)
        mesh.vertices = wp.from_torch(self.vertices, dtype=wp.vec3)
        mesh.balls = wp.zeros(len(self.quads), dtype=wp.vec4, device=device)
        launch(bound_quads, len(self.quads), [mesh], device)
        return mesh


def build_mesh(solid: np.ndarray, centroid: np.ndarray, device: str) -> QuadMesh:
    """The mesh between solid cells.

    Args:
        solid: [P, P, P] bool, cells that rays saw something in.
        centroid: [P, P, P, 3], where in the cube they saw it; not finite where unknown.

    Raises:
        TrainingFailed: no quad is left.
    """
    cells = solid.shape[0]
    solid = solid.copy()
    for axis in range(3):  # a vertex on the cube's rim would have quads that leave it
        np.moveaxis(solid, axis, 0)[[0, -1]] = False
    index = np.arange(cells**3).reshape(solid.shape)
    corners = np.concatenate([_quads_across(solid, index, axis) for axis in range(3)])
    if len(corners) == 0:
        raise TrainingFailed(
            "mesh",
            "some surface must have been found",
            "an empty scene",
            "Check the poses and the background; a capture needs photos that overlap.",
        )
    kept, quads = np.unique(corners, return_inverse=True)
    mesh = QuadMesh(cells, kept, torch.empty(0), quads.reshape(-1, CORNERS).astype(np.int32))
    centres = mesh.centres()
    seen = centroid.reshape(-1, 3)[kept]
    reach = VERTEX_REACH * mesh.cell_size
    moved = np.clip(np.where(np.isfinite(seen), seen - centres, 0.0), -reach, reach)
    vertices = torch.from_numpy((centres + moved).astype(np.float32)).to(device)
    return replace(mesh, vertices=vertices)


def _distance_to(kept: np.ndarray, cells: int) -> np.ndarray:
    """[cells^3] int32: how many cells away, along the farthest axis, the nearest kept cell is; at most FARTHEST."""
    near = torch.zeros(1, 1, cells, cells, cells)
    near.view(-1)[torch.from_numpy(kept)] = 1.0
    distance = torch.full((cells**3,), FARTHEST, dtype=torch.int32)
    for steps in range(FARTHEST):
        distance[(near.view(-1) > 0) & (distance == FARTHEST)] = steps
        near = functional.max_pool3d(near, 3, 1, 1)
    return distance.numpy()


def _quads_across(solid: np.ndarray, index: np.ndarray, axis: int) -> np.ndarray:
    """[n, 4] cells around each grid edge along an axis that has four solid cells."""
    s, i = np.moveaxis(solid, axis, 0), np.moveaxis(index, axis, 0)
    around = s[:, :-1, :-1] & s[:, 1:, :-1] & s[:, :-1, 1:] & s[:, 1:, 1:]
    a, b, c = np.nonzero(around)
    return np.stack([i[a, b, c], i[a, b, c + 1], i[a, b + 1, c], i[a, b + 1, c + 1]], -1)


def patch_weights(K: int) -> np.ndarray:
    """[K, K, 4] float64: weights of the corners 00, 01, 10, 11 at the texel centres (i / (K - 1), j / (K - 1))."""
    a, b = np.meshgrid(np.linspace(0, 1, K), np.linspace(0, 1, K), indexing="ij")
    low, high = np.minimum(a, b), np.maximum(a, b)
    return np.stack([1.0 - high, np.maximum(b - a, 0.0), np.maximum(a - b, 0.0), low], -1)
