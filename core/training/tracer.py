"""Traces pixels' sub-rays against a quad mesh, composites what they hit, and takes the gradient back."""

from typing import Any, Protocol

import torch
import warp as wp
from torch import Tensor

from core.field.frame import as_vec3, empty
from core.kernels.composite import PixelSums
from core.kernels.launch import launch
from core.kernels.silhouettes import silhouette_gradient
from core.kernels.trace import Hits, bound_quads
from core.kernels.types import vec8
from core.mesh.quad_mesh import QuadMesh
from core.training.pixels import Batch

SUBRAYS_IN_PAIRS = 4  # what the kernel of silhouettes reads of each pixel, in rows of two


class Rays(Protocol):
    """Origins and directions [n, 3] in the scene's frame."""

    @property
    def origins(self) -> Tensor: ...

    @property
    def directions(self) -> Tensor: ...


class Tracer:
    """Buffers for `pixels` pixels of `subrays` rays with at most `capacity` hits each; deeper hits are not seen."""

    def __init__(
        self, mesh: QuadMesh, kernels: tuple[wp.Kernel, ...], pixels: int, subrays: int, capacity: int
    ) -> None:
        self.device = str(mesh.vertices.device)
        self.pixels, self.subrays = pixels, subrays
        self.kernel_mesh = mesh.kernel_mesh(self.device)
        self._trace, self._composite, self._backward = kernels
        shape = (pixels * subrays, capacity)
        self.quad = empty(*shape, device=self.device, dtype=torch.int32)
        self.alpha, self.transmittance = empty(*shape, device=self.device), empty(*shape, device=self.device)
        self.count = empty(shape[0], device=self.device, dtype=torch.int32)
        self._ab, self.t = empty(*shape, 2, device=self.device), empty(*shape, device=self.device)
        self._features = empty(*shape, 8, device=self.device)
        self.hits = self._kernel_hits()
        self._continuous, self._binary = self._new_sums(), self._new_sums()

    def forward(self, batch: Rays, surface: Any, *, binary_only: bool) -> tuple[tuple[Tensor, Tensor], ...]:
        """((features times coverage [n, 8], coverage [n]) of the continuous model, the same of the binary one)."""
        rays = [as_vec3(batch.origins), as_vec3(batch.directions)]
        launch(self._trace, self.pixels * self.subrays,
               [self.kernel_mesh, surface, *rays, int(binary_only), self.hits], self.device)  # fmt: skip
        sums = [_kernel_sums(*self._continuous), _kernel_sums(*self._binary)]
        launch(self._composite, self.pixels, [surface, *rays, self.subrays, self.hits, *sums], self.device)
        return tuple((F.clone(), A.clone()) for F, A in (self._continuous, self._binary))

    def backward(
        self,
        batch: Batch,
        surface: Any,
        grad_continuous: tuple[Tensor, ...],
        grad_binary: tuple[Tensor, ...],
        gradients: Any,
        parts: int,
    ) -> None:
        """Adds the gradients of the last `forward` to the accumulators."""
        rays = [as_vec3(batch.origins), as_vec3(batch.directions)]
        grads = [_kernel_sums(*grad_continuous), _kernel_sums(*grad_binary)]
        shared = [self.kernel_mesh, surface, *rays, self.subrays, self.hits, *grads]
        launch(self._backward, self.pixels, lambda part: [*shared, part, gradients], self.device, parts)

    def silhouettes(self, batch: Batch, grad_binary: tuple[Tensor, ...], gap: float, parts: int, vertices: Any) -> None:
        """Adds the gradients of the last `forward`'s silhouettes, where depths differ by more than `gap`, to the
        vertices' accumulators. A pixel of other than four sub-rays has no pairs to look at, and adds nothing."""
        if self.subrays != SUBRAYS_IN_PAIRS:
            return
        shared = [self.kernel_mesh, as_vec3(batch.origins), as_vec3(batch.directions), self.hits,
                  _kernel_sums(*grad_binary), gap]  # fmt: skip
        launch(silhouette_gradient, self.pixels, lambda part: [*shared, part, vertices], self.device, parts)

    def vertices_moved(self) -> None:
        """To be called when the mesh's vertices have changed."""
        launch(bound_quads, self.kernel_mesh.quads.shape[0], [self.kernel_mesh], self.device)

    def seen_quads(self, least: float) -> Tensor:
        """Quads with a hit of the last `forward` that weighs more than `least`."""
        index = torch.arange(self.quad.shape[1], device=self.device)
        weighty = (self.transmittance * self.alpha > least) & (index < self.count[:, None])
        return self.quad[weighty].long()

    def _new_sums(self) -> tuple[Tensor, Tensor]:
        return empty(self.pixels, 8, device=self.device), empty(self.pixels, device=self.device)

    def _kernel_hits(self) -> Hits:
        hits = Hits()
        hits.quad, hits.ab = wp.from_torch(self.quad), wp.from_torch(self._ab, dtype=wp.vec2)
        hits.t, hits.alpha = wp.from_torch(self.t), wp.from_torch(self.alpha)
        hits.transmittance = wp.from_torch(self.transmittance)
        hits.features, hits.count = wp.from_torch(self._features, dtype=vec8), wp.from_torch(self.count)
        return hits


def _kernel_sums(features: Tensor, alpha: Tensor) -> PixelSums:
    sums = PixelSums()
    sums.features, sums.alpha = wp.from_torch(features.contiguous(), dtype=vec8), wp.from_torch(alpha.contiguous())
    return sums
