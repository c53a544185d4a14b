"""Stages 1b and 2: the mesh, with opacity and features from a volume; continuous and binary models together.

The mesh starts as the voxel field's surface (surfacing.py). Rays meet it, not the volume between; its vertices, the
volume and the network train on both models' errors (eq. 14), the binary one's share growing. In the end, quads that no
ray sees go.
"""

from typing import Any

import torch
import warp as wp
from torch import nn

from core.field.bricks import places_in
from core.field.network import shade
from core.field.parameters import Parameters
from core.field.space import Space
from core.kernels.surfaces import VOLUME_KERNELS, VolumeGradients
from core.kernels.types import vec8
from core.mesh.quad_mesh import QuadMesh
from core.presets import Settings
from core.training.drawing import BatchSequence
from core.training.loss import color_error, pixel_loss
from core.training.marcher import step_grid
from core.training.pixels import PixelPool
from core.training.stage import Stage
from core.training.surfacing import HIT_CAPACITY, surfaced
from core.training.tracer import Tracer
from core.training.vertices import MovingVertices
from core.training.volume import volume_of
from core.training.voxel_stage import VoxelStage

FEATURE_RATE, ALPHA_RATE, NETWORK_RATE = 0.01, 0.02, 2e-3
# In cells. Vertices start on the surface, and faster ones leave it again: still_lambert, 600 steps, four sub-rays:
# 26.5 dB at 0.02, 27.0 at 0.008, 26.8 at 0.003, 26.4 at 0.001. A pull to their cells' centres (eq. 6) changes nothing.
VERTEX_RATE, VERTEX_PULL = 0.01, 0.0
# A node or vertex is touched once in a dozen steps: with a short memory its last few gradients alone say how large its
# steps are. lego_400, 600 steps, baked: 28.94 dB at 0.95, 29.27 at 0.99, 29.46 at 0.997, 29.48 at 0.999.
BETA2 = 0.997
FINAL_RATE = 0.1
SEEN_WEIGHT = 0.03
BINARY_SHARE = (0.1, 0.6)  # of the loss, from the first step to the last; (0.2, 0.8) 0.07 dB less, (0.4, 0.9) 0.26
PRUNING_STARTS = 0.75


class FieldStage(Stage):
    """Trains mesh and volume."""

    name = "field"

    def __init__(
        self,
        pool: PixelPool,
        mesh: QuadMesh,
        nodes: int,
        parameters: Parameters,
        network: nn.Sequential,
        settings: Settings,
        seed: int,
        device: str,
    ) -> None:
        super().__init__(network, settings, settings.field_steps, seed, device)
        self.mesh, self.nodes, self.parameters = mesh, nodes, parameters
        self.seen = torch.zeros(len(mesh.quads), dtype=torch.bool, device=device)
        self._batches = BatchSequence(pool, settings.field_batch, supersampled=False)
        self._tracer = Tracer(mesh, VOLUME_KERNELS, settings.field_batch, 1, HIT_CAPACITY)
        self._volume = volume_of(mesh.space, nodes, parameters)
        self._touched = torch.zeros(len(parameters.trained), dtype=torch.uint8, device=device)
        self._vertices = MovingVertices(mesh, BETA2)
        self._gradients = self._kernel_gradients()

    @classmethod
    def after(cls, voxels: VoxelStage, pool: PixelPool) -> "FieldStage":
        """The stage that follows a finished voxel stage."""
        settings, device = voxels.settings, voxels.device
        cameras = [view.camera for view in voxels.capture.train]
        mesh, alpha = surfaced(voxels.field, pool, voxels.region.frame, cameras, settings.cells, device)
        learned = voxels.field.parameters
        parameters = Parameters.starting_from(alpha, learned.features, learned.trained)
        return cls(pool, mesh, voxels.field.nodes, parameters, voxels.network, settings, voxels.seed, device)

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
    ) -> "FieldStage":
        nodes, trained = state["nodes"], state["trained"].to(device)
        n = places_in(nodes)
        nothing = torch.zeros(n, device=device), torch.zeros(n, 8, device=device)
        parameters = Parameters.starting_from(*nothing, trained)
        parameters.restore_rows(state["rows"])
        vertices = state["vertices"].to(device)
        kept, quads, shell_cells = (state[name].numpy() for name in ("kept", "quads", "shell_cells"))
        mesh = QuadMesh(settings.cells, kept, vertices, quads, space, shell_cells)
        stage = cls(pool, mesh, nodes, parameters, network, settings, seed, device)
        stage.restore(state)
        return stage

    def step(self) -> float:
        batch = self._batches.draw(self.done)
        sums = self._tracer.forward(batch, self._volume, binary_only=False)
        (F, A), (F_binary, A_binary) = sums
        for tensor in (F, A, F_binary, A_binary):
            tensor.requires_grad_()
        color = shade(self.network, F, A, batch.centre_directions)
        color_binary = shade(self.network, F_binary, A_binary, batch.centre_directions)
        share = BINARY_SHARE[0] + (BINARY_SHARE[1] - BINARY_SHARE[0]) * self.fraction
        weight = self.settings.coverage
        loss = (1.0 - share) * pixel_loss(color, A, batch.color, batch.alpha, weight)
        loss = loss + share * pixel_loss(color_binary, A_binary, batch.color, batch.alpha, weight)
        falling = FINAL_RATE**self.fraction
        self.optimize_network(loss, NETWORK_RATE * falling)
        soft, hard = (tuple(self.gradient(x, len(A)) for x in pair) for pair in ((F, A), (F_binary, A_binary)))
        self._tracer.backward(batch, self._volume, soft, hard, self._gradients, self.parameters.parts)
        rates = (ALPHA_RATE * falling, FEATURE_RATE * falling)
        step_grid(self.parameters, self._touched, rates, 0.0, (0.0, 1.0), BETA2,
                  self.done + 1, self.device)  # fmt: skip
        self._vertices.step(VERTEX_RATE * falling, VERTEX_PULL, self.done + 1)
        self._tracer.vertices_moved()
        if self.fraction >= PRUNING_STARTS or self.done + 1 == self.steps:
            self.seen[self._tracer.seen_quads(SEEN_WEIGHT)] = True
        return color_error(color_binary, A_binary, batch.color, batch.alpha)

    def _kernel_gradients(self) -> VolumeGradients:
        gradients = VolumeGradients()
        alpha, features = self.parameters.gradients
        gradients.row_of = wp.from_torch(self.parameters.row_of)
        gradients.alpha, gradients.features = wp.from_torch(alpha), wp.from_torch(features, dtype=vec8)
        gradients.touched = wp.from_torch(self._touched)
        gradients.vertices = self._vertices.gradients
        return gradients

    def own_state(self) -> dict[str, Any]:
        return {
            "nodes": self.nodes,
            "trained": self.parameters.trained,
            "rows": self.parameters.rows(),
            "kept": torch.from_numpy(self.mesh.kept),
            "quads": torch.from_numpy(self.mesh.quads),
            "shell_cells": torch.from_numpy(self.mesh.shell_cells),
            "vertices": self.mesh.vertices,
            "vertex_moments": self._vertices.moments,
            "seen": self.seen,
        }

    def restore_own(self, state: dict[str, Any]) -> None:
        self._vertices.restore(state["vertex_moments"])
        self.seen = state["seen"].to(self.device)
