"""What training rays saw of the voxel field, per cell of the mesh to be."""

from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from core.kernels.launch import accumulator_parts
from core.mesh.quad_mesh import FACES


@dataclass(frozen=True)
class Survey:
    """Accumulators, one row for each part of a launch.

    Attributes:
        cells: P, per axis.
        shells: around the cells, besides the innermost one; -1: none at all.
        peak, mass: [parts, P^3], largest weight and sum of weights seen in each cell.
        moment: [parts, P^3, 3], sum of weight times place in the cells' cube.
        shell_peak: [parts, (shells + 1) * 6 * P^2], largest weight seen near each cell of the shells.
    """

    cells: int
    shells: int
    peak: Tensor
    mass: Tensor
    moment: Tensor
    shell_peak: Tensor

    @classmethod
    def empty(cls, cells: int, shells: int, device: str) -> "Survey":
        parts, n = accumulator_parts(device), cells**3
        peak, mass = torch.zeros(parts, n, device=device), torch.zeros(parts, n, device=device)
        moment = torch.zeros(parts, n, 3, device=device)
        shell_peak = torch.zeros(parts, (shells + 1) * FACES * cells**2, device=device)
        return cls(cells, shells, peak, mass, moment, shell_peak)

    def centroids(self) -> np.ndarray:
        """[P^3, 3] float32, where rays saw something in each cell; NaN where they saw nothing."""
        mass, moment = self.mass.sum(0), self.moment.sum(0)
        centroid = (moment / mass.clamp_min(1e-9)[:, None]).cpu().numpy()
        centroid[mass.cpu().numpy() <= 0] = np.nan
        return centroid
