"""Marches batches of rays through a voxel field and back, with buffers that grow where a ray needs more samples."""

import torch
import warp as wp
from torch import Tensor

from core.field.frame import as_vec3, empty
from core.field.parameters import Parameters
from core.field.voxels import VoxelField
from core.kernels.adam import adam_grid, bias_correction
from core.kernels.launch import launch
from core.kernels.march import Samples, march_backward, march_forward, survey
from core.kernels.smoothness import smoothness_gradient
from core.kernels.types import vec8
from core.training.survey import Survey

FIRST_CAPACITY = 48


class Marcher:
    """Buffers for rays through one voxel field."""

    def __init__(self, field: VoxelField, device: str) -> None:
        self.field, self.device = field, device
        self._capacity = min(FIRST_CAPACITY, field.max_samples())
        self._rays = 0
        self.refresh()

    def refresh(self) -> None:
        """To be called when the field's occupancy has changed."""
        self._grid = self.field.grid()
        self._touched = torch.zeros(len(self.field.parameters.trained), dtype=torch.uint8, device=self.device)

    def forward(self, origins: Tensor, directions: Tensor, jitter: Tensor) -> tuple[Tensor, Tensor]:
        """Features times opacity [n, 8] and opacity [n] along rays [n, 3]; jitter [n] in [0, 1) moves the samples."""
        if self._rays != len(origins):
            self._allocate(len(origins))
        while True:
            inputs = [
                self._grid, as_vec3(origins), as_vec3(directions), wp.from_torch(jitter), self.samples,
                wp.from_torch(self._features, dtype=vec8), wp.from_torch(self._alpha),
            ]  # fmt: skip
            launch(march_forward, len(origins), inputs, self.device)
            # A ray that was cut short would train a different scene: redo the batch with more room.
            if int(self._count.max()) <= self._capacity:
                return self._features.clone(), self._alpha.clone()
            self._capacity = min(2 * self._capacity, self.field.max_samples())
            self._allocate(len(origins))

    def backward(self, origins: Tensor, directions: Tensor, grad_F: Tensor, grad_A: Tensor, distortion: float) -> None:
        """Adds the gradients of the last `forward` to the field's accumulators."""
        scalar, features = self.field.parameters.gradients
        shared = [
            self._grid, as_vec3(origins), as_vec3(directions), self.samples,
            wp.from_torch(grad_F, dtype=vec8), wp.from_torch(grad_A), distortion,
        ]  # fmt: skip
        outputs = [wp.from_torch(scalar), wp.from_torch(features, dtype=vec8), wp.from_torch(self._touched)]
        parts = self.field.parameters.parts
        launch(march_backward, len(origins), lambda part: [*shared, part, *outputs], self.device, parts)

    def survey(self, origins: Tensor, directions: Tensor, found: Survey) -> None:
        """Adds what the last `forward` saw."""
        outputs = [wp.from_torch(found.peak), wp.from_torch(found.mass), as_vec3(found.moment),
                   wp.from_torch(found.shell_peak)]  # fmt: skip
        shared = [as_vec3(origins), as_vec3(directions), self.samples, self._grid.space,
                  found.cells, found.shells]  # fmt: skip
        launch(survey, len(origins), lambda part: [*shared, part, *outputs], self.device, found.peak.shape[0])

    def smooth(self, weight: float) -> None:
        """Adds the gradient of the features' smoothness to the rows that the last `backward` touched."""
        learned = self.field.parameters
        inputs = [
            self.field.nodes, weight, wp.from_torch(learned.trained), wp.from_torch(learned.row_of),
            wp.from_torch(self._touched), wp.from_torch(learned.features, dtype=vec8),
            wp.from_torch(learned.gradients[1], dtype=vec8),
        ]  # fmt: skip
        launch(smoothness_gradient, len(learned.trained), inputs, self.device)

    def adam(
        self, rates: tuple[float, float], decay: float, bounds: tuple[float, float], beta2: float, steps: int
    ) -> None:
        step_grid(self.field.parameters, self._touched, rates, decay, bounds, beta2, steps, self.device)

    def _allocate(self, rays: int) -> None:
        self._rays = rays
        shape = (rays, self._capacity)
        self._count = torch.zeros(rays, dtype=torch.int32, device=self.device)
        self._features, self._alpha = empty(rays, 8, device=self.device), empty(rays, device=self.device)
        samples = Samples()
        samples.t = wp.empty(shape, dtype=float, device=self.device)
        samples.s = wp.empty(shape, dtype=float, device=self.device)
        samples.alpha = wp.empty(shape, dtype=float, device=self.device)
        samples.transmittance = wp.empty(shape, dtype=float, device=self.device)
        samples.features = wp.empty(shape, dtype=vec8, device=self.device)
        samples.count = wp.from_torch(self._count)
        self.samples = samples


def step_grid(
    parameters: Parameters,
    touched: Tensor,
    rates: tuple[float, float],
    decay: float,
    bounds: tuple[float, float],
    beta2: float,
    steps: int,
    device: str,
) -> None:
    """One Adam step of the touched rows. Args: rates: of scalar and features. bounds: of the scalar. beta2: Adam's."""
    inputs = [
        wp.from_torch(parameters.trained), wp.from_torch(touched),
        parameters.scalar_state(), parameters.feature_state(),
        rates[0], rates[1], decay, bounds[0], bounds[1], beta2, bias_correction(steps, beta2),
    ]  # fmt: skip
    launch(adam_grid, len(parameters.trained), inputs, device)
