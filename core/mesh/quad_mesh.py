"""The quad mesh (paper 3.1): one vertex per kept cell of a P^3 grid, one quad per grid edge between four kept cells.

Around an unbounded scene's cells stand shells: concentric cubes whose faces are cut into P x P quads that stay where
they are (supplement H).
"""

from dataclasses import dataclass, field, replace

import numpy as np
import torch
import warp as wp
from torch import Tensor
from torch.nn import functional

from core.errors import TrainingFailed
from core.field.bricks import BRICK, brick_places, bricks_along
from core.field.space import SHELLS, Space
from core.kernels.launch import launch
from core.kernels.trace import QuadMesh as KernelMesh
from core.kernels.trace import bound_quads

# A vertex may go this far from its cell's centre, in cells: within the cell, so that rays find every hit.
VERTEX_REACH = 0.49
CORNERS = 4
FACES = 6
# Empty space is skipped in blocks of at most this many cells to each side.
FARTHEST = 16


@dataclass(frozen=True)
class QuadMesh:
    """A mesh in the scene's frame.

    Attributes:
        cells: P, per axis.
        kept: [V] int64, the flat index of each movable vertex's cell.
        vertices: [V + S, 3] float32 tensor, scene points: the V movable ones, trained in place, then the shells'.
        quads: [Q, 4] int32, vertices at the corners 00, 01, 10, 11; the diagonal runs from 00 to 11.
        space: where the cells lie.
        shell_cells: [Q] int64, a shell's quad's cell among those of all shells' faces; -1 for other quads. Empty: none.
    """

    cells: int
    kept: np.ndarray
    vertices: Tensor
    quads: np.ndarray
    space: Space = field(default_factory=Space.cube)
    shell_cells: np.ndarray = field(default_factory=lambda: np.zeros(0, np.int64))

    @property
    def cell_size(self) -> float:
        """In the cells' own cube [-1, 1]^3."""
        return 2.0 / self.cells

    @property
    def shells(self) -> int:
        """Shells besides the innermost one: they begin as far apart as the cells are large."""
        return shells_around(self.space, self.cells)

    def centres(self) -> np.ndarray:
        """[V, 3] float32, the cells' centres in their cube [-1, 1]^3."""
        ijk = np.stack(np.unravel_index(self.kept, (self.cells,) * 3), -1)
        return ((ijk + 0.5) * self.cell_size - 1.0).astype(np.float32)

    def with_quads(self, keep: np.ndarray) -> "QuadMesh":
        """The mesh with some of its quads, [Q] bool."""
        shell_cells = self.shell_cells[keep] if len(self.shell_cells) else self.shell_cells
        return replace(self, quads=np.ascontiguousarray(self.quads[keep]), shell_cells=shell_cells)

    def kernel_mesh(self, device: str) -> KernelMesh:
        """The mesh as kernels read it: each cell with the quads that use its vertex."""
        corner = self.quads.reshape(-1)
        order = np.argsort(corner, kind="stable")
        start = np.searchsorted(corner[order], np.arange(len(self.kept) + 1))
        mesh = KernelMesh()
        mesh.cells, mesh.space, mesh.movable = self.cells, self.space.kernel_space(), len(self.kept)
        mesh.bricks = bricks_along(self.cells)
        distances, slots = self._cells_in_bricks()
        mesh.cell_distance = wp.array(distances, dtype=wp.uint8, device=device)
        mesh.cell_slot = wp.array(slots, dtype=wp.int32, device=device)
        mesh.slot_start = wp.array(start.astype(np.int32), dtype=wp.int32, device=device)
        mesh.slot_quads = wp.array((order // CORNERS).astype(np.int32), dtype=wp.int32, device=device)
        # A quad's corners and its ball lie in one cache line: tracing reads the one after the other.
        records = torch.zeros(len(self.quads), 2, CORNERS, device=device)
        corners = records[:, 1].view(torch.int32)
        corners.copy_(torch.from_numpy(self.quads))
        mesh.balls, mesh.quads = wp.from_torch(records[:, 0], dtype=wp.vec4), wp.from_torch(corners, dtype=wp.vec4i)
        mesh.vertices = wp.from_torch(self.vertices, dtype=wp.vec3)
        halves = self.space.shell_halves(self.shells).astype(np.float32)
        shell_quads = np.full(len(halves) * FACES * self.cells**2, -1, np.int32)
        if len(self.shell_cells):
            of_shells = np.flatnonzero(self.shell_cells >= 0)
            shell_quads[self.shell_cells[of_shells]] = of_shells
        mesh.shell_halves = wp.array(halves, dtype=wp.float32, device=device)
        mesh.shell_quads = wp.array(shell_quads, dtype=wp.int32, device=device)
        launch(bound_quads, len(self.quads), [mesh], device)
        return mesh

    def _cells_in_bricks(self) -> tuple[np.ndarray, np.ndarray]:
        """(cells to the nearest kept cell [places] uint8, slots of kept cells [places] int32), in brick order."""
        shape = (self.cells,) * 3
        place = brick_places(np.moveaxis(np.indices(shape), 0, -1).reshape(-1, 3), self.cells)
        distances = np.full(bricks_along(self.cells) ** 3 * BRICK**3, FARTHEST, np.uint8)
        distances[place] = _distance_to(self.kept, self.cells)
        slots = np.zeros(len(distances), np.int32)
        slots[place[self.kept]] = np.arange(len(self.kept))
        return distances, slots


def shells_around(space: Space, cells: int) -> int:
    """How many shells stand around a space's cells, besides the one on their rim."""
    return cells // 2 if space.kind == SHELLS else 0


def quads_between(solid: np.ndarray) -> np.ndarray:
    """[n, 4] flat indices of the four cells around each grid edge, where all four are solid [P, P, P] (bool)."""
    index = np.arange(solid.size).reshape(solid.shape)
    return np.concatenate([_quads_across(solid, index, axis) for axis in range(3)])


def mesh_of(
    corners: np.ndarray,
    places: np.ndarray,
    cells: int,
    device: str,
    space: Space | None = None,
    shells: np.ndarray | None = None,
) -> QuadMesh:
    """The mesh of some of the grid's quads, and the shells' seen ones.

    Args:
        corners: [n, 4] flat indices of the cells whose vertices are the corners of each quad.
        places: [P^3, 3], where in the cells' cube each cell's vertex starts; its centre where not finite.
        cells: P.
        shells: [shells + 1, 6, P, P] bool, cells of the shells' faces that rays saw something near.

    Raises:
        TrainingFailed: no quad is left.
    """
    space = space or Space.cube()
    corners = np.unique(corners.reshape(-1, CORNERS), axis=0)
    # A vertex on the cube's rim would have quads that leave it.
    within = np.stack(np.unravel_index(corners, (cells,) * 3), -1)
    corners = corners[((within > 0) & (within < cells - 1)).all((1, 2))]
    shell_vertices, shell_quads, shell_cells = _shell_quads(space, cells, shells)
    if len(corners) + len(shell_quads) == 0:
        raise TrainingFailed(
            "mesh",
            "some surface must have been found",
            "an empty scene",
            "Check the poses and the background; a capture needs photos that overlap.",
        )
    kept, quads = _in_brick_order(corners, cells)
    quads = np.concatenate([quads, shell_quads + len(kept)]).astype(np.int32)
    of_shells = np.concatenate([np.full(len(corners), -1), shell_cells]) if len(shell_cells) else np.zeros(0, np.int64)
    mesh = QuadMesh(cells, kept, torch.empty(0), quads, space, of_shells)
    centres = mesh.centres()
    seen = places[kept]
    reach = VERTEX_REACH * mesh.cell_size
    moved = np.clip(np.where(np.isfinite(seen), seen - centres, 0.0), -reach, reach)
    vertices = np.concatenate([space.cells_to_scene(centres + moved), shell_vertices])
    return replace(mesh, vertices=torch.from_numpy(vertices.astype(np.float32)).to(device))


def _shell_quads(space: Space, cells: int, seen: np.ndarray | None) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(vertices [S, 3], quads [n, 4], cells [n]) of the shells' seen quads; faces by axis, the negative one first."""
    if seen is None or not seen.any():
        return np.zeros((0, 3)), np.zeros((0, CORNERS), np.int64), np.zeros(0, np.int64)
    flat = np.flatnonzero(seen)
    shell, face, i, j = np.unravel_index(flat, seen.shape)
    half = space.shell_halves(shells_around(space, cells))[shell]
    axis, side = face // 2, np.where(face % 2, 1.0, -1.0)
    places = np.empty((len(flat), CORNERS, 3))
    for corner, (a, b) in enumerate(((0, 0), (0, 1), (1, 0), (1, 1))):
        along = np.stack([i + a, j + b], -1) * (2.0 / cells) - 1.0
        for ax, others in enumerate(((1, 2), (0, 2), (0, 1))):
            here = axis == ax
            places[here, corner, ax] = (side * half)[here]
            for k, other in enumerate(others):
                places[here, corner, other] = (along[:, k] * half)[here]
    vertices, quads = np.unique(places.reshape(-1, 3), axis=0, return_inverse=True)
    return vertices, quads.reshape(-1, CORNERS), flat


def _distance_to(kept: np.ndarray, cells: int) -> np.ndarray:
    """[cells^3] int32: how many cells away, along the farthest axis, the nearest kept cell is; at most FARTHEST."""
    near = torch.zeros(1, 1, cells, cells, cells)
    near.view(-1)[torch.from_numpy(kept)] = 1.0
    distance = torch.full((cells**3,), FARTHEST, dtype=torch.int32)
    for steps in range(FARTHEST):
        distance[(near.view(-1) > 0) & (distance == FARTHEST)] = steps
        near = functional.max_pool3d(near, 3, 1, 1)
    return distance.numpy()


def _in_brick_order(corners: np.ndarray, cells: int) -> tuple[np.ndarray, np.ndarray]:
    """(kept cells [V], quads [n, 4] of places among them) of quads between cells [n, 4], both in brick order."""
    kept, quads = np.unique(corners, return_inverse=True)
    place = brick_places(np.stack(np.unravel_index(kept, (cells,) * 3), -1), cells)
    order = np.argsort(place)
    rank = np.empty_like(order)
    rank[order] = np.arange(len(order))
    quads = rank[quads.reshape(-1, CORNERS)]
    return kept[order], quads[np.argsort(quads[:, 0], kind="stable")]


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
