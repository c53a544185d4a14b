"""A mesh's vertices as they train."""

from collections.abc import Sequence
from typing import Any

import torch
from torch import Tensor

from core.field.frame import as_vec3
from core.kernels.adam import adam_vertices, bias_correction
from core.kernels.launch import accumulator_parts, launch
from core.mesh.quad_mesh import VERTEX_REACH, QuadMesh


class MovingVertices:
    """Gradients and Adam's moments of a mesh's movable vertices, which are stepped in place.

    Attributes:
        gradients: accumulators [parts, vertices] for kernels, in the scene's frame; zero between steps.
        moments: first and second, [vertices, 3], in the cells' cube.
    """

    def __init__(self, mesh: QuadMesh, beta2: float) -> None:
        self._mesh, self._beta2 = mesh, beta2
        self._device = str(mesh.vertices.device)
        parts = accumulator_parts(self._device)
        self._grad = torch.zeros(parts, *mesh.vertices.shape, device=self._device)
        self.gradients: Any = as_vec3(self._grad)
        self.moments = (torch.zeros_like(mesh.vertices), torch.zeros_like(mesh.vertices))
        self._centres = torch.from_numpy(mesh.centres()).to(self._device)
        self._space = mesh.space.kernel_space()

    @property
    def parts(self) -> int:
        return self._grad.shape[0]

    def step(self, rate: float, pull: float, steps: int) -> None:
        """One step of each vertex that has a gradient. Args: rate: in cells. steps: taken, this one included."""
        if len(self._mesh.kept) == 0:  # shells alone, which stay where they are
            return
        size = self._mesh.cell_size
        value, m1, m2, centres = (as_vec3(t) for t in (self._mesh.vertices, *self.moments, self._centres))
        inputs = [self._space, value, self.gradients, m1, m2, centres, VERTEX_REACH * size, rate * size, pull,
                  self._beta2, bias_correction(steps, self._beta2)]  # fmt: skip
        launch(adam_vertices, len(self._mesh.kept), inputs, self._device)

    def restore(self, moments: Sequence[Tensor]) -> None:
        for mine, saved in zip(self.moments, moments, strict=True):
            mine.copy_(saved)
