"""Stage 1a: a voxel field, coarse to fine. It finds out in a minute where surfaces are.

The paper's stage 1 learns opacity with 8 x 384 networks on the mesh itself, for hours. A voxel field learns the same
scene 100 times faster, and the mesh then starts from where its surfaces are. docs/training.md says what was tried.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
from torch import Tensor, nn

from core.capture import Capture
from core.device import torch_threads
from core.field.network import shade
from core.field.region import Region
from core.field.space import CUBE, SHELLS, TAPER
from core.field.voxels import EMPTY_DENSITY, HIGHEST_DENSITY, VoxelField
from core.kernels.launch import THREADS
from core.presets import Settings
from core.training.drawing import BatchSequence
from core.training.exposure import LEAST_SPREAD, BrightnessSurvey, exposure_differences, spread_of
from core.training.loss import color_error, pixel_loss
from core.training.marcher import Marcher
from core.training.pixels import PixelPool
from core.training.stage import Stage

# A higher density rate makes surfaces thinner, at the same PSNR (lego_400, 256 nodes, spread of a ray's weight in mesh
# cells: 0.60 at 0.08, 0.29 at 0.3), and thin surfaces lose less when they become quads: +0.75 dB there. At 1.0 nothing
# is learned any more (24.2 dB).
DENSITY_RATE, FEATURE_RATE, NETWORK_RATE = 0.3, 0.03, 5e-3
BETA2 = 0.99  # 0.997: 31.3 instead of 31.6 dB
# Without an alpha channel nothing says where air is, and what turns solid too early stays in the way. On fern (504 px,
# 128 nodes, 800 steps) the held-out views get 22.9 dB at 0.04, 22.6 at 0.08, 21.5 at 0.15 and less at 0.3; with a
# distortion loss 10 times as strong, 4.5 dB less on the training views at 0.08.
# Fox, whose cameras stand within the grid, does better with twice that and a distortion loss three times as strong
# (192 nodes: 24.7 dB and 27.1 on the training views, instead of 24.3 and 29.3 with 224 nodes).
OPEN_DENSITY_RATES = {TAPER: 0.04, SHELLS: 0.08}
OPEN_DISTORTIONS = {TAPER: 0.1, SHELLS: 0.33}  # of the settings' distortion
# Over the second half of the steps it grows to this multiple, where no alpha channel says what is air: what becomes
# quads is then thinner. Fox: half of the quads at the start, 0.1 dB better in the end. For objects: thin parts go
# (lego_400: 0.6 dB worse).
OPEN_LATE_DISTORTION = 10.0
# Pull of features towards their neighbours', times 1/2 of their squared difference. Few photos see a place of an open
# scene, and floaters explain what they see: fox 24.0 -> 25.4 dB in the end, fern 22.4 -> 23.2, with half of the quads.
# For objects, 0.001 makes 7 % fewer quads and is worth nothing in the end, 0.01 costs the voxels 1.1 dB.
OPEN_SMOOTHNESS = 0.003
# Rates fall to this share, exponentially. 0.03 costs 1 dB in 2000 steps, 0.3 gains 0.2.
FINAL_RATE = 0.2
DENSITY_DECAY = 0.05  # empty space must cost something; falls to nothing
OCCUPANCY_INTERVAL = 200
SMALLEST_IMAGE_PX = 100
# Exposure is looked for before these levels. Earlier the field is too coarse; later it has learned part of it as shine.
EVENED_LEVELS = (2, 3)
BRIGHTNESS_PIXELS, BRIGHTNESS_BATCH = 400, 4096  # per photo; at once
PIXELS_PER_NODE = 1.5  # photos finer than the grid teach it nothing


@dataclass(frozen=True)
class Level:
    """A grid resolution: nodes per axis, the step it ends at, cells of its occupancy grid, batch size."""

    nodes: int
    end: int
    occupancy_cells: int
    batch: int


def levels_of(settings: Settings) -> tuple[Level, ...]:
    """Four resolutions up to the settings' own; the coarse ones take short, cheap steps."""
    n, total = settings.nodes, settings.voxel_steps
    batch = settings.voxel_batch
    shares = ((n // 6, 0.2, 4), (n // 3, 0.5, 2), (n * 3 // 4, 0.75, 1), (n, 1.0, 1))
    return tuple(
        Level(max(nodes, 16), round(share * total), min(max(64, n // 3), 96), max(batch // part, 64))
        for nodes, share, part in shares
    )


class VoxelStage(Stage):
    """Trains the voxel field."""

    name = "voxels"

    def __init__(
        self, capture: Capture, region: Region, network: nn.Sequential, settings: Settings, seed: int, device: str
    ) -> None:
        super().__init__(network, settings, settings.voxel_steps, seed, device)
        self.capture, self.region = capture, region
        self.log_gains: Tensor | None = None  # [photos, 3], see core/training/exposure.py; None: no differences
        self._density_rate = OPEN_DENSITY_RATES.get(region.space.kind, DENSITY_RATE)
        self._distortion = settings.distortion * OPEN_DISTORTIONS.get(region.space.kind, 1.0)
        is_open = region.space.kind != CUBE
        self._late_distortion = OPEN_LATE_DISTORTION if is_open else 1.0
        self._smoothness = OPEN_SMOOTHNESS if is_open else 0.0
        self._levels = levels_of(settings)
        self._enter(VoxelField.new(region.space, self._levels[0].nodes, region.hull, seed, device))

    def _enter(self, field: VoxelField) -> None:
        self.field, self.marcher = field, Marcher(field, self.device)
        largest = max(max(view.camera.size_px) for view in self.capture.train)
        factor = min(round(largest / (PIXELS_PER_NODE * field.nodes)), largest // SMALLEST_IMAGE_PX)
        self._pool = PixelPool(self.capture.train, self.region.frame, self.device, max(1, factor), self.seed)
        self._pool.log_gains = self.log_gains
        self._batches: BatchSequence | None = None
        self._steps_here = 0

    def _level(self) -> Level:
        return next(level for level in self._levels if self.done < level.end or level is self._levels[-1])

    def step(self) -> float:
        level = self._level()
        if level.nodes != self.field.nodes:
            if self._levels.index(level) in EVENED_LEVELS:
                self._even_exposure()
            with torch_threads(THREADS):  # no kernel runs meanwhile
                finer = self.field.upsampled(level.nodes)
            self._enter(finer)
            self._update_occupancy(level)
        elif self._steps_here and self._steps_here % OCCUPANCY_INTERVAL == 0:
            self._update_occupancy(level)
        self._steps_here += 1
        batch = self._batches_of(level).draw(self._steps_here)
        rng = np.random.default_rng([self.seed, 2, self.done])
        jitter = torch.from_numpy(rng.random(level.batch, dtype=np.float32)).to(self.device)
        F, A = self.marcher.forward(batch.origins, batch.directions, jitter)
        F.requires_grad_()
        A.requires_grad_()
        color = shade(self.network, F, A, batch.centre_directions)
        loss = pixel_loss(color, A, batch.color, batch.alpha, self.settings.coverage)
        falling = FINAL_RATE**self.fraction
        self.optimize_network(loss, NETWORK_RATE * falling)
        grads = self.gradient(F, level.batch), self.gradient(A, level.batch)
        self.marcher.backward(batch.origins, batch.directions, *grads, self._distortion_weight())
        if self._smoothness:
            self.marcher.smooth(self._smoothness)
        rates = (self._density_rate * falling, FEATURE_RATE * falling)
        decay = DENSITY_DECAY * (1.0 - self.fraction)
        self.marcher.adam(rates, decay, (EMPTY_DENSITY, HIGHEST_DENSITY), BETA2, self._steps_here)
        return color_error(color, A, batch.color, batch.alpha)

    def _batches_of(self, level: Level) -> BatchSequence:
        """Levels of the same nodes have one pool, and may have batches of their own sizes."""
        if self._batches is None or self._batches.count != level.batch:
            self._batches = BatchSequence(self._pool, level.batch, supersampled=False)
        return self._batches

    def _distortion_weight(self) -> float:
        if self._level() is self._levels[0]:
            return 0.0
        late = max(0.0, 2.0 * self.fraction - 1.0)
        return self._distortion * (1.0 + (self._late_distortion - 1.0) * late**2)

    def _even_exposure(self) -> None:
        """Finds how differently the photos are exposed; from now on their colours are freed of it."""
        cameras = [view.camera for view in self.capture.train]
        survey = BrightnessSurvey(len(cameras), self.device)
        jitter = torch.full((BRIGHTNESS_BATCH,), 0.5, device=self.device)
        for number in range(-(-len(cameras) * BRIGHTNESS_PIXELS // BRIGHTNESS_BATCH)):
            batch = self._pool.draw(number, BRIGHTNESS_BATCH, supersampled=False)
            F, A = self.marcher.forward(batch.origins, batch.directions, jitter)
            with torch.no_grad():
                color = shade(self.network, F, A, batch.centre_directions)
            survey.add(color, A, batch.color, batch.alpha, batch.image)
        differences = exposure_differences(survey.log_ratios(), cameras)
        if self.log_gains is not None or spread_of(differences) >= LEAST_SPREAD:
            more = torch.from_numpy(differences.astype(np.float32)).to(self.device)
            self.log_gains = more if self.log_gains is None else self.log_gains + more

    def _update_occupancy(self, level: Level) -> None:
        with torch_threads(THREADS):
            self.field.update_occupancy(level.occupancy_cells, self.region.hull)
        self.marcher.refresh()

    def own_state(self) -> dict[str, Any]:
        return {
            "nodes": self.field.nodes,
            "steps_here": self._steps_here,
            "log_gains": self.log_gains,
            "occupied": self.field.occupied,
            "trained": self.field.parameters.trained,
            "rows": self.field.parameters.rows(),
        }

    def restore_own(self, state: dict[str, Any]) -> None:
        field = VoxelField.new(self.region.space, state["nodes"], self.region.hull, self.seed, self.device)
        field.parameters.scalar.fill_(EMPTY_DENSITY)
        field.occupied = state["occupied"].to(self.device)
        field.parameters = field.parameters.training(state["trained"].to(self.device))
        field.parameters.restore_rows(state["rows"])
        self.log_gains = None if state["log_gains"] is None else state["log_gains"].to(self.device)
        self._enter(field)
        self._steps_here = state["steps_here"]
