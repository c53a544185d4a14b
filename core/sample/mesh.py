"""Triangle meshes with what the sample's materials need at every vertex."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt


@dataclass(frozen=True)
class Mesh:
    """Triangles of one or more materials, z up.

    Attributes:
        positions, normals: [n, 3] float64; normals are unit and point out of solids.
        uv: [n, 2] float64, surface coordinates as the material wants them.
        material: [n] int32, see `core.sample.kernels`.
        faces: [m, 3] int32.
    """

    positions: np.ndarray
    normals: np.ndarray
    uv: np.ndarray
    material: np.ndarray
    faces: np.ndarray

    def moved(self, offset: npt.ArrayLike) -> Mesh:
        return Mesh(self.positions + np.asarray(offset), self.normals, self.uv, self.material, self.faces)

    def rotated(self, rotation: np.ndarray) -> Mesh:
        """Turned by a rotation matrix [3, 3]."""
        return Mesh(self.positions @ rotation.T, self.normals @ rotation.T, self.uv, self.material, self.faces)


def joined(meshes: Sequence[Mesh]) -> Mesh:
    """One mesh of several."""
    starts = np.cumsum([0, *(len(mesh.positions) for mesh in meshes[:-1])])
    return Mesh(
        np.concatenate([mesh.positions for mesh in meshes]),
        np.concatenate([mesh.normals for mesh in meshes]),
        np.concatenate([mesh.uv for mesh in meshes]),
        np.concatenate([mesh.material for mesh in meshes]),
        np.concatenate([mesh.faces + start for mesh, start in zip(meshes, starts, strict=True)]).astype(np.int32),
    )


def grid_mesh(positions: np.ndarray, normals: np.ndarray, uv: np.ndarray, material: int) -> Mesh:
    """A sheet from vertices [rows, columns, ...]."""
    rows, columns = positions.shape[:2]
    corner = (np.arange(rows - 1)[:, None] * columns + np.arange(columns - 1)).ravel()
    upper = np.stack([corner, corner + 1, corner + columns], -1)
    lower = np.stack([corner + 1, corner + columns + 1, corner + columns], -1)
    return Mesh(
        positions.reshape(-1, 3),
        normals.reshape(-1, 3),
        uv.reshape(-1, 2),
        np.full(rows * columns, material, np.int32),
        np.concatenate([upper, lower]).astype(np.int32),
    )
