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
    """Trainable entries.

    Attributes:
        scalar: [n] float32, opacity in [0, 1] or raw density.
        features: [n, 8] float32 in [0, 1].
        moments: Adam's first and second moments of scalar and features.
        gradients: accumulators of scalar [parts, n] and features [parts, n, 8]; zero between steps.
    """

    scalar: Tensor
    features: Tensor
    moments: tuple[Tensor, Tensor, Tensor, Tensor]
    gradients: tuple[Tensor, Tensor]

    @classmethod
    def starting_from(cls, scalar: Tensor, features: Tensor) -> "Parameters":
        """Fresh moments. Untouched zero pages cost no memory, so large arrays may be mostly empty."""
        n, device = len(scalar), scalar.device
        parts = accumulator_parts(str(device))

        def zeros(*shape: int) -> Tensor:
            return torch.zeros(shape, dtype=torch.float32, device=device)

        moments = (zeros(n), zeros(n), zeros(n, FEATURE_CHANNELS), zeros(n, FEATURE_CHANNELS))
        return cls(scalar, features, moments, (zeros(parts, n), zeros(parts, n, FEATURE_CHANNELS)))

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

    def rows(self, index: Tensor) -> dict[str, Tensor]:
        """What a checkpoint keeps of some entries."""
        moments = {f"m{i}": moment[index] for i, moment in enumerate(self.moments)}
        return {"scalar": self.scalar[index], "features": self.features[index], **moments}

    def restore_rows(self, index: Tensor, rows: dict[str, Tensor]) -> None:
        """Puts back what `rows` returned."""
        self.scalar[index] = rows["scalar"].to(self.scalar.device)
        self.features[index] = rows["features"].to(self.scalar.device)
        for i, moment in enumerate(self.moments):
            moment[index] = rows[f"m{i}"].to(moment.device)
