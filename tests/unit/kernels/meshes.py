"""Quad meshes with vertices anywhere in their cells."""

from dataclasses import replace

import numpy as np
import torch
import warp as wp

from core.field.space import Space
from core.kernels.surfaces import Texels
from core.kernels.types import vec8
from core.mesh import quad_mesh
from core.mesh.quad_mesh import VERTEX_REACH, QuadMesh, quads_between

WIDTH = 2.0


def build_mesh(
    solid: np.ndarray, centroid: np.ndarray, device: str, space: Space | None = None, shells: np.ndarray | None = None
) -> QuadMesh:
    """The mesh of all quads between solid cells [P, P, P] (bool), its vertices at the centroids [P, P, P, 3]."""
    corners, places = quads_between(solid), centroid.reshape(-1, 3)
    return quad_mesh.mesh_of(corners, places, len(solid), device, space, shells)


def mesh_of(
    rng: np.random.Generator,
    cells: int,
    solid: np.ndarray,
    spread: float = VERTEX_REACH,
    device: str = "cpu",
    space: Space | None = None,
    shells: np.ndarray | None = None,
) -> QuadMesh:
    """The mesh between solid cells, its vertices moved by up to `spread` cells along each axis."""
    ticks = (np.arange(cells) + 0.5) * (WIDTH / cells) - 1.0
    centres = np.stack(np.meshgrid(ticks, ticks, ticks, indexing="ij"), -1)
    moved = centres + rng.uniform(-spread, spread, centres.shape) * (WIDTH / cells)
    return build_mesh(solid, moved, device, space, shells)


def random_mesh(rng: np.random.Generator, cells: int = 7, share: float = 0.8, device: str = "cpu") -> QuadMesh:
    """A share of all cells is solid: quads everywhere, across all three axes."""
    return mesh_of(rng, cells, rng.random((cells,) * 3) < share, device=device)


def sheet_mesh(rng: np.random.Generator, cells: int = 8, spread: float = VERTEX_REACH, device: str = "cpu") -> QuadMesh:
    """One layer of cells at right angles to z: a sheet without holes from rim to rim."""
    solid = np.zeros((cells,) * 3, bool)
    solid[:, :, cells // 2] = True
    return mesh_of(rng, cells, solid, spread, device)


def with_vertices(mesh: QuadMesh, vertices: np.ndarray) -> QuadMesh:
    return replace(mesh, vertices=torch.from_numpy(vertices.astype(np.float32)).to(mesh.vertices.device))


def exact(mesh: QuadMesh) -> tuple[torch.Tensor, torch.Tensor]:
    """(vertices [V, 3] float64, quads [Q, 4] int64), as the oracle takes them."""
    return mesh.vertices.detach().cpu().double(), torch.from_numpy(mesh.quads).long()


def texels_of(alpha: np.ndarray, features: np.ndarray, device: str = "cpu") -> Texels:
    """The kernels' texels: alpha [Q, K, K], features [Q, K, K, 8]."""
    texels = Texels()
    texels.K = alpha.shape[1]
    texels.alpha = wp.array(alpha.reshape(-1).astype(np.float32), dtype=float, device=device)
    texels.features = wp.array(features.reshape(-1, 8).astype(np.float32), dtype=vec8, device=device)
    return texels


def clear_texels(mesh: QuadMesh, device: str = "cpu") -> Texels:
    """Fully transparent: a ray goes on for ever."""
    shape = (len(mesh.quads), 2, 2)
    return texels_of(np.zeros(shape), np.zeros((*shape, 8)), device)
