"""The acceleration grid G: an upper bound on how much any ray sees of a cell (eq. 10 and 11)."""

import torch
from torch import Tensor, nn

from benchmarks.reference_setting.setting import GRID_SMOOTH, GRID_SPARSE, GRID_THRESHOLD


class AccelerationGrid(nn.Module):
    """`bound` [P, P, P], from nothing."""

    def __init__(self, cells: int) -> None:
        super().__init__()
        self.bound = nn.Parameter(torch.zeros(cells, cells, cells))

    def nonempty(self) -> Tensor:
        """[P^3] bool (eq. 8)."""
        return (self.bound.detach() > GRID_THRESHOLD).reshape(-1)

    def loss(self, positions: Tensor, weight: Tensor) -> Tensor:
        """Eq. 19 for points [n, 3] of the cube that were seen with a weight T_k alpha_k [n]; only G gets gradients."""
        P = self.bound.shape[0]
        cell = ((positions.detach() + 1.0) * (0.5 * P)).long().clamp(0, P - 1)
        missing = (weight.detach() - self.bound[cell[:, 0], cell[:, 1], cell[:, 2]]).clamp_min(0.0)
        bounded = missing.mean() if len(missing) else self.bound.sum() * 0.0
        smooth = sum(self.bound.diff(dim=axis).square().mean() for axis in range(3))
        return bounded + GRID_SPARSE * self.bound.abs().mean() + GRID_SMOOTH * smooth
