"""Opacity or density, and features, of many entries, with what Adam keeps of them."""

from dataclasses import dataclass

import torch
import warp as wp
from torch import Tensor

from core.conventions import FEATURE_CHANNELS
from core.kernels.adam import FeatureState, ScalarState
from core.kernels.launch import accumulator_parts
from core.kernels.types import vec8


@dataclass
class Parameters:
    """Entries of which some train. A large grid is mostly air: only what trains has moments and gradients.

    Attributes:
        scalar: [n] float32, opacity in [0, 1] or raw density.
        features: [n, 8] float32 in [0, 1].
        trained: [m] int32, the entries that train; their places here are their rows.
        row_of: [n] int32, each entry's row, or -1.
        moments: Adam's first and second moments of the rows' scalars [m] and features [m, 8].
        gradients: accumulators of scalar [parts, m] and features [parts, m, 8]; zero between steps.

    Moments of a row lie side by side in memory, and so do its accumulators: a step that touches scattered rows waits
    for fewer cache lines.
    """

    scalar: Tensor
    features: Tensor
    trained: Tensor
    row_of: Tensor
    moments: tuple[Tensor, Tensor, Tensor, Tensor]
    gradients: tuple[Tensor, Tensor]

    @classmethod
    def starting_from(cls, scalar: Tensor, features: Tensor, trained: Tensor | None = None) -> "Parameters":
        """Fresh moments. Args: trained: [m] int32; None: every entry."""
        n, device = len(scalar), scalar.device
        if trained is None:
            trained = torch.arange(n, dtype=torch.int32, device=device)
        m, parts = len(trained), accumulator_parts(str(device))

        def zeros(*shape: int) -> Tensor:
            return torch.zeros(shape, dtype=torch.float32, device=device)

        of_scalars, of_features = zeros(m, 2), zeros(m, 2, FEATURE_CHANNELS)
        moments = of_scalars[:, 0], of_scalars[:, 1], of_features[:, 0], of_features[:, 1]
        gradients = zeros(m, parts).T, zeros(m, parts, FEATURE_CHANNELS).transpose(0, 1)
        return cls(scalar, features, trained, _rows_of(trained, n), moments, gradients)

    def training(self, trained: Tensor) -> "Parameters":
        """The same entries, of which others train; those that go on training keep their moments."""
        fresh = Parameters.starting_from(self.scalar, self.features, trained)
        before = self.row_of[trained.long()].long()
        stays = before >= 0
        for new, old in zip(fresh.moments, self.moments, strict=True):
            new[stays] = old[before[stays]]
        return fresh

    @property
    def parts(self) -> int:
        return self.gradients[0].shape[0]

    def scalar_state(self) -> ScalarState:
        state = ScalarState()
        state.value = wp.from_torch(self.scalar)
        state.grad = wp.from_torch(self.gradients[0])
        state.moment1, state.moment2 = wp.from_torch(self.moments[0]), wp.from_torch(self.moments[1])
        return state

    def feature_state(self) -> FeatureState:
        state = FeatureState()
        state.value = wp.from_torch(self.features, dtype=vec8)
        state.grad = wp.from_torch(self.gradients[1], dtype=vec8)
        state.moment1 = wp.from_torch(self.moments[2], dtype=vec8)
        state.moment2 = wp.from_torch(self.moments[3], dtype=vec8)
        return state

    def rows(self) -> dict[str, Tensor]:
        """What a checkpoint keeps: the entries that train."""
        index = self.trained.long()
        moments = {f"m{i}": moment for i, moment in enumerate(self.moments)}
        return {"scalar": self.scalar[index], "features": self.features[index], **moments}

    def restore_rows(self, rows: dict[str, Tensor]) -> None:
        """Puts back what `rows` returned, into parameters of which the same entries train."""
        index = self.trained.long()
        self.scalar[index] = rows["scalar"].to(self.scalar.device)
        self.features[index] = rows["features"].to(self.scalar.device)
        for i, moment in enumerate(self.moments):
            moment.copy_(rows[f"m{i}"])


def _rows_of(trained: Tensor, n: int) -> Tensor:
    """[n] int32: the row of each entry, -1 of those that do not train."""
    rows = torch.full((n,), -1, dtype=torch.int32, device=trained.device)
    rows[trained.long()] = torch.arange(len(trained), dtype=torch.int32, device=trained.device)
    return rows
