"""Stages 1b and 2: the mesh, with opacity and features from a volume; continuous and binary models together.

The mesh starts where the voxel field is seen. Rays meet it, not the volume between; its vertices, the volume and the
network train on both models' errors (eq. 14), the binary one's share growing. In the end, quads that no ray sees go.
"""

from typing import Any

import torch
import warp as wp
from torch import Tensor, nn

from core.field.bricks import places_in, to_bricks
from core.field.frame import as_vec3, empty
from core.field.network import shade
from core.field.parameters import Parameters
from core.field.space import CUBE, SHELLS, Space
from core.field.voxels import DENSITY_SCALE, VoxelField
from core.kernels.adam import adam_vertices, bias_correction
from core.kernels.launch import accumulator_parts, launch
from core.kernels.surfaces import VOLUME_KERNELS, Volume, VolumeGradients, sample_volume
from core.kernels.types import vec8
from core.mesh.quad_mesh import FACES, VERTEX_REACH, QuadMesh, build_mesh, shells_around
from core.presets import Settings
from core.training.drawing import BatchSequence
from core.training.loss import color_error, pixel_loss
from core.training.marcher import Marcher, step_grid
from core.training.pixels import PixelPool
from core.training.stage import Stage
from core.training.survey import Survey
from core.training.tracer import Tracer
from core.training.voxel_stage import VoxelStage

FEATURE_RATE, ALPHA_RATE, NETWORK_RATE = 0.01, 0.02, 2e-3
VERTEX_RATE = 0.02  # in cells
VERTEX_PULL = 1e-4
# A node or vertex is touched once in a dozen steps: with a short memory its last few gradients alone say how large its
# steps are. lego_400, 600 steps, baked: 28.94 dB at 0.95, 29.27 at 0.99, 29.46 at 0.997, 29.48 at 0.999.
BETA2 = 0.997
FINAL_RATE = 0.1
HIT_CAPACITY = 24
SURVEY_RAYS, SURVEY_BATCH = 400_000, 8192
SOLID_WEIGHT = 0.002  # 0.01 leaves out thin parts (-0.3 dB on lego_400), 0.1 leaves holes (-3 dB)
OPEN_SOLID_WEIGHT = 0.01  # without alpha there is haze: at 0.002 fox began with 570,000 quads, and lost 2 dB
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
        parts = accumulator_parts(device)
        self._vertex_grad = torch.zeros(parts, *mesh.vertices.shape, device=device)
        self._vertex_moments = (torch.zeros_like(mesh.vertices), torch.zeros_like(mesh.vertices))
        self._kernel_space = mesh.space.kernel_space()
        self._centres = torch.from_numpy(mesh.centres()).to(device)
        self._gradients = self._kernel_gradients()

    @classmethod
    def after(cls, voxels: VoxelStage, pool: PixelPool) -> "FieldStage":
        """The stage that follows a finished voxel stage."""
        settings, device = voxels.settings, voxels.device
        mesh = _surveyed_mesh(voxels.field, pool, settings.cells, device)
        density = voxels.field.parameters.scalar.clamp_min(0.0)
        # A quad stands for the matter within about a cell of it.
        alpha = 1.0 - torch.exp(-density * (DENSITY_SCALE * mesh.cell_size * mesh.space.inner))
        backdrop = to_bricks(torch.from_numpy(mesh.space.backdrop(voxels.field.nodes)))
        alpha[backdrop.to(device)] = 1.0
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
        self._step_vertices(VERTEX_RATE * self.mesh.cell_size * falling)
        if self.fraction >= PRUNING_STARTS or self.done + 1 == self.steps:
            self.seen[self._tracer.seen_quads(SEEN_WEIGHT)] = True
        return color_error(color_binary, A_binary, batch.color, batch.alpha)

    def _step_vertices(self, rate: float) -> None:
        reach = VERTEX_REACH * self.mesh.cell_size
        state = [self.mesh.vertices, *self._vertex_moments, self._centres]
        value, m1, m2, centres = (as_vec3(tensor) for tensor in state)
        grad = as_vec3(self._vertex_grad)
        inputs = [self._kernel_space, value, grad, m1, m2, centres, reach, rate, VERTEX_PULL,
                  BETA2, bias_correction(self.done + 1, BETA2)]  # fmt: skip
        launch(adam_vertices, len(self.mesh.kept), inputs, self.device)
        self._tracer.vertices_moved()

    def _kernel_gradients(self) -> VolumeGradients:
        gradients = VolumeGradients()
        alpha, features = self.parameters.gradients
        gradients.row_of = wp.from_torch(self.parameters.row_of)
        gradients.alpha, gradients.features = wp.from_torch(alpha), wp.from_torch(features, dtype=vec8)
        gradients.touched = wp.from_torch(self._touched)
        gradients.vertices = as_vec3(self._vertex_grad)
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
            "vertex_moments": self._vertex_moments,
            "seen": self.seen,
        }

    def restore_own(self, state: dict[str, Any]) -> None:
        for mine, saved in zip(self._vertex_moments, state["vertex_moments"], strict=True):
            mine.copy_(saved)
        self.seen = state["seen"].to(self.device)


def volume_of(space: Space, nodes: int, parameters: Parameters) -> Volume:
    """The volume as kernels read it."""
    volume = Volume()
    volume.space = space.kernel_space()
    volume.nodes = nodes
    volume.alpha = wp.from_torch(parameters.scalar)
    volume.features = wp.from_torch(parameters.features, dtype=vec8)
    return volume


def sampled(volume: Volume, points: Tensor, device: str) -> tuple[Tensor, Tensor]:
    """Opacity [n] and features [n, 8] of a volume at points [n, 3] of the cube."""
    alpha, features = empty(len(points), device=device), empty(len(points), 8, device=device)
    outputs = [wp.from_torch(alpha), wp.from_torch(features, dtype=vec8)]
    launch(sample_volume, len(points), [volume, as_vec3(points), *outputs], device)
    return alpha, features


def _surveyed_mesh(field: VoxelField, pool: PixelPool, cells: int, device: str) -> QuadMesh:
    """The mesh around what training rays see of the voxel field."""
    shells = shells_around(field.space, cells)
    survey = Survey.empty(cells, shells if field.space.kind == SHELLS else -1, device)
    marcher = Marcher(field, device)
    jitter = torch.full((SURVEY_BATCH,), 0.5, device=device)
    for number in range(SURVEY_RAYS // SURVEY_BATCH):
        batch = pool.draw(number, SURVEY_BATCH, supersampled=False)
        marcher.forward(batch.origins, batch.directions, jitter)
        marcher.survey(batch.origins, batch.directions, survey)
    shape = (cells,) * 3
    least = SOLID_WEIGHT if field.space.kind == CUBE else OPEN_SOLID_WEIGHT
    solid = (survey.peak.amax(0) > least).cpu().numpy().reshape(shape)
    seen = (survey.shell_peak.amax(0) > least).cpu().numpy().reshape(-1, FACES, cells, cells)
    return build_mesh(solid, survey.centroids().reshape(*shape, 3), device, field.space, seen)
