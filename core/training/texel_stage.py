"""Stage 2b: the texels themselves. What is trained here is what is shipped.

Four sub-rays a pixel look up the nearest texel, as the viewer will. Both models at first, then the binary one alone,
and in the end with opacity frozen (eq. 21). Texels that few rays meet would keep what is noise in these: each is pulled
towards its neighbours a little.
"""

from typing import Any

import numpy as np
import torch
import warp as wp
from torch import Tensor, nn

from core.errors import TrainingFailed
from core.field.network import shade
from core.field.parameters import Parameters
from core.field.space import Space
from core.kernels.adam import adam_texels
from core.kernels.launch import launch
from core.kernels.smoothness import texel_smoothness_gradient
from core.kernels.surfaces import TEXEL_KERNELS, TexelGradients, Texels
from core.kernels.types import vec8
from core.mesh.quad_mesh import QuadMesh, patch_weights
from core.presets import Settings
from core.training.drawing import BatchSequence
from core.training.field_stage import FieldStage
from core.training.loss import color_error, pixel_loss
from core.training.pixels import PixelPool
from core.training.stage import Stage
from core.training.surfacing import HIT_CAPACITY
from core.training.tracer import Tracer
from core.training.vertices import MovingVertices
from core.training.volume import sampled, volume_of

FEATURE_RATE, ALPHA_RATE, NETWORK_RATE = 0.01, 0.015, 2e-3
FINAL_RATE = 0.1
CONTINUOUS_UNTIL, OPACITY_UNTIL = 0.4, 0.75  # of the steps
LEAST_BINARY_SHARE = 0.3
SMOOTHNESS = 0.01  # docs/training.md
# Vertices move where silhouettes say so (core/kernels/silhouettes.py): rate in cells, and how far apart in depth two
# surfaces are, in cells. docs/training.md.
VERTEX_RATE, VERTEX_BETA2, GAP = 0.01, 0.997, 0.5
SUBRAYS = 4
QUADS_AT_ONCE = 20_000
Lists = list[tuple[int, list[Any]]]  # (length, inputs of kernels that go through it) of each part's touched texels


class TexelStage(Stage):
    """Trains the texels of a fixed mesh."""

    name = "texels"

    def __init__(
        self,
        pool: PixelPool,
        mesh: QuadMesh,
        parameters: Parameters,
        network: nn.Sequential,
        settings: Settings,
        seed: int,
        device: str,
    ) -> None:
        super().__init__(network, settings, settings.texel_steps, seed, device)
        self.mesh, self.parameters = mesh, parameters
        self._batches = BatchSequence(pool, settings.texel_batch, supersampled=True)
        self._tracer = Tracer(mesh, TEXEL_KERNELS, settings.texel_batch, SUBRAYS, HIT_CAPACITY)
        self._texels = Texels()
        self._texels.K = settings.patch
        self._texels.alpha = wp.from_torch(parameters.scalar)
        self._texels.features = wp.from_torch(parameters.features, dtype=vec8)
        n, parts = len(parameters.scalar), parameters.parts
        capacity = min(n, settings.texel_batch * SUBRAYS * HIT_CAPACITY)
        self._vertices = MovingVertices(mesh, VERTEX_BETA2)
        self._updates = torch.zeros(n, dtype=torch.int32, device=device)
        self._stamp = torch.full((parts, n), -1, dtype=torch.int32, device=device)
        self._touched = torch.empty(parts, capacity, dtype=torch.int32, device=device)
        self._touched_count = torch.zeros(parts, dtype=torch.int32, device=device)

    @classmethod
    def after(cls, field: FieldStage, pool: PixelPool) -> "TexelStage":
        """The stage that follows a finished field stage: its quads that are seen, with the volume baked onto them.

        Raises:
            TrainingFailed: no quad is seen.
        """
        if not field.seen.any():
            raise TrainingFailed("mesh", "some quad must be seen", "none", "Check the poses and the background.")
        mesh = field.mesh.with_quads(field.seen.cpu().numpy())
        volume = volume_of(mesh.space, field.nodes, field.parameters)
        baked = [sampled(volume, points, field.device) for points in _texel_points(mesh, field.settings.patch)]
        alpha, features = (torch.cat([part[i] for part in baked]) for i in (0, 1))
        parameters = Parameters.starting_from(alpha, features)
        return cls(pool, mesh, parameters, field.network, field.settings, field.seed, field.device)

    @classmethod
    def restored(
        cls,
        pool: PixelPool,
        space: Space,
        state: dict[str, Any],
        network: nn.Sequential,
        settings: Settings,
        seed: int,
        device: str,
    ) -> "TexelStage":
        kept, quads, shell_cells = (state[name].numpy() for name in ("kept", "quads", "shell_cells"))
        mesh = QuadMesh(settings.cells, kept, state["vertices"].to(device), quads, space, shell_cells)
        n = len(state["rows"]["scalar"])
        parameters = Parameters.starting_from(torch.zeros(n, device=device), torch.zeros(n, 8, device=device))
        parameters.restore_rows(state["rows"])
        stage = cls(pool, mesh, parameters, network, settings, seed, device)
        stage.restore(state)
        return stage

    def step(self) -> float:
        both, with_alpha = self.fraction < CONTINUOUS_UNTIL, self.fraction < OPACITY_UNTIL
        batch = self._batches.draw(self.done)
        (F, A), (F_binary, A_binary) = self._tracer.forward(batch, self._texels, binary_only=not both)
        for tensor in (F, A, F_binary, A_binary):
            tensor.requires_grad_()
        weight = self.settings.coverage
        color = shade(self.network, F_binary, A_binary, batch.centre_directions)
        loss = pixel_loss(color, A_binary, batch.color, batch.alpha, weight)
        if both:
            share = max(LEAST_BINARY_SHARE, self.fraction / CONTINUOUS_UNTIL)
            blended = shade(self.network, F, A, batch.centre_directions)
            loss = share * loss + (1.0 - share) * pixel_loss(blended, A, batch.color, batch.alpha, weight)
        falling = FINAL_RATE**self.fraction
        self.optimize_network(loss, NETWORK_RATE * falling)
        soft, hard = (tuple(self.gradient(x, len(A)) for x in pair) for pair in ((F, A), (F_binary, A_binary)))
        gradients = self._kernel_gradients(with_alpha)
        self._tracer.backward(batch, self._texels, soft, hard, gradients, self.parameters.parts)
        self._tracer.silhouettes(batch, hard, GAP * self.mesh.cell_size, self._vertices.parts, self._vertices.gradients)
        self._vertices.step(VERTEX_RATE * falling, 0.0, self.done + 1)
        self._tracer.vertices_moved()
        lists = self._lists()
        self._smooth(lists)
        self._adam(lists, ALPHA_RATE * falling if with_alpha else 0.0, FEATURE_RATE * falling)
        return color_error(color, A_binary, batch.color, batch.alpha)

    def _kernel_gradients(self, with_alpha: bool) -> TexelGradients:
        self._touched_count.zero_()
        alpha, features = self.parameters.gradients
        gradients = TexelGradients()
        gradients.alpha, gradients.features = wp.from_torch(alpha), wp.from_torch(features, dtype=vec8)
        gradients.stamp, gradients.touched = wp.from_torch(self._stamp), wp.from_torch(self._touched)
        gradients.touched_count = wp.from_torch(self._touched_count)
        gradients.batch, gradients.with_alpha = self.done, int(with_alpha)
        return gradients

    def _smooth(self, lists: Lists) -> None:
        """Adds the gradient of the touched texels' smoothness."""
        texels, gradient = self._texels, wp.from_torch(self.parameters.gradients[1], dtype=vec8)
        for part, (count, listed) in enumerate(lists):
            inputs = [*listed, part, texels.K, SMOOTHNESS, texels.alpha, texels.features, gradient]
            launch(texel_smoothness_gradient, count, inputs, self.device)

    def _adam(self, lists: Lists, alpha_rate: float, feature_rate: float) -> None:
        state = [self.parameters.scalar_state(), self.parameters.feature_state(), wp.from_torch(self._updates)]
        for part, (count, listed) in enumerate(lists):
            launch(adam_texels, count, [*listed, part, *state, alpha_rate, feature_rate], self.device)

    def _lists(self) -> Lists:
        """Of the texels that the last backward pass touched. Waits for it."""
        listed = [wp.from_torch(self._touched), wp.from_torch(self._stamp), self.done]
        return [(count, listed) for count in self._touched_count.tolist()]

    def own_state(self) -> dict[str, Any]:
        return {
            "rows": self.parameters.rows(),
            "updates": self._updates,
            "kept": torch.from_numpy(self.mesh.kept),
            "quads": torch.from_numpy(self.mesh.quads),
            "shell_cells": torch.from_numpy(self.mesh.shell_cells),
            "vertices": self.mesh.vertices,
            "vertex_moments": self._vertices.moments,
        }

    def restore_own(self, state: dict[str, Any]) -> None:
        self._updates.copy_(state["updates"])
        self._vertices.restore(state["vertex_moments"])


def _texel_points(mesh: QuadMesh, K: int) -> list[Tensor]:
    """The texels' centres [n * K * K, 3] in the cube, some quads at a time."""
    weights = torch.from_numpy(patch_weights(K).astype(np.float32)).to(mesh.vertices.device)
    quads = torch.from_numpy(mesh.quads).long().to(mesh.vertices.device)
    return [
        torch.einsum("abk,qkd->qabd", weights, mesh.vertices[some]).reshape(-1, 3).contiguous()
        for some in quads.split(QUADS_AT_ONCE)
    ]
