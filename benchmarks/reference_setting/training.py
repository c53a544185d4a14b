"""Stages 1 and 2 of the paper, for a given time."""

import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from benchmarks.reference_setting import setting as numbers
from benchmarks.reference_setting.acceleration import AccelerationGrid
from benchmarks.reference_setting.cube import Cube, cube_around
from benchmarks.reference_setting.grid_mesh import GridMesh
from benchmarks.reference_setting.networks import PaperNetworks
from benchmarks.reference_setting.pixels import PixelBatch, Pixels
from benchmarks.reference_setting.quadrature import intersections
from benchmarks.reference_setting.rendering import (
    Points,
    color_per_pixel,
    color_per_point,
    points_of,
    visibility,
)
from benchmarks.reference_setting.setting import SUBRAYS, PaperSetting
from core.capture import Capture
from core.training.loss import psnr_of

RAYS_AT_ONCE = 2048  # while measuring


@dataclass(frozen=True)
class Moment:
    """Where training stands: seconds, share of the time, and what the time's schedule says."""

    seconds: float
    share: float

    @property
    def stage(self) -> int:
        return 1 if self.share < numbers.STAGE1_UNTIL else 2

    @property
    def fine_tuning(self) -> bool:
        return self.share >= numbers.STAGE2_UNTIL

    @property
    def points_divisor(self) -> int:
        """1 while all 3P points of a ray are kept, then 2, then 4 (supplement G)."""
        part = self.share / numbers.STAGE1_UNTIL
        return 1 if part < numbers.ALL_POINTS_UNTIL else 2 if part < numbers.HALF_POINTS_UNTIL else 4

    @property
    def rate(self) -> float:
        """The learning rate: falling exponentially, after a warm-up."""
        falling = numbers.FIRST_RATE * (numbers.LAST_RATE / numbers.FIRST_RATE) ** min(self.share, 1.0)
        warm = np.sin(0.5 * np.pi * min(self.share / numbers.WARM_UP, 1.0))
        return float(falling * (numbers.WARM_UP_RATE + (1.0 - numbers.WARM_UP_RATE) * warm))


class PaperRun:
    """One training under way.

    Attributes:
        seconds: trained so far; measuring does not count.
        steps: done so far.
    """

    def __init__(self, capture: Capture, setting: PaperSetting, *, device: str, seed: int = 0) -> None:
        self.capture, self.setting, self.device, self.seed = capture, setting, device, seed
        self.cube: Cube = cube_around(capture)
        self.networks = PaperNetworks(setting, seed).to(device)
        self.mesh = GridMesh(setting.cells).to(device)
        self.grid = AccelerationGrid(setting.cells).to(device)
        self._pixels = Pixels(capture.train, self.cube, capture.background, device)
        self._background = torch.tensor(capture.background, dtype=torch.float32, device=device)
        parameters = [
            {"params": [*self.networks.parameters(), *self.grid.parameters()], "factor": 1.0},
            {"params": [self.mesh.offsets], "factor": numbers.VERTEX_RATE},
        ]
        self._adam = torch.optim.Adam(parameters, betas=numbers.ADAM_BETAS, eps=numbers.ADAM_EPSILON)
        self.seconds, self.steps = 0.0, 0

    def train(self, budget_s: float, watch: Callable[["PaperRun", Moment], None] = lambda run, moment: None) -> None:
        """Trains for `budget_s` seconds. `watch` is called after each step, and its time does not count."""
        while self.seconds < budget_s:
            moment = Moment(self.seconds, self.seconds / budget_s)
            started = time.monotonic()
            self.step(moment)
            if self.device != "cpu":
                torch.cuda.synchronize()
            self.seconds += time.monotonic() - started
            watch(self, Moment(self.seconds, self.seconds / budget_s))

    def step(self, moment: Moment) -> float:
        """One step; returns the loss of its colours."""
        setting, rng = self.setting, np.random.default_rng([self.seed, self.steps])
        rays = max(setting.batch * self._divisor(moment) // 4, SUBRAYS)
        if moment.stage == 1:
            batch = self._pixels.draw(rng, rays, supersampled=False)
        else:
            batch = self._pixels.draw(rng, rays // SUBRAYS, supersampled=True)
        points, positions = self._points(batch, self._keep(moment), self._nonempty(moment))
        loss = self._color_loss(points, batch, moment)
        total = loss
        if not moment.fine_tuning:
            weight = visibility(points.alpha)[points.hits.ray, points.hits.rank]
            total = loss + self._vertex_loss() + self.grid.loss(positions, weight)
        self._optimise(total, moment)
        self.steps += 1
        return float(loss.detach())

    def _divisor(self, moment: Moment) -> int:
        return moment.points_divisor if self.setting.prune else 1

    def _keep(self, moment: Moment) -> int:
        return 3 * self.setting.cells // self._divisor(moment)

    def _nonempty(self, moment: Moment) -> Tensor | None:
        return self.grid.nonempty() if self._divisor(moment) > 1 else None

    def _points(self, batch: PixelBatch, keep: int, nonempty: Tensor | None) -> tuple[Points, Tensor]:
        hits = intersections(self.mesh, batch.origins, batch.directions, keep, nonempty)
        positions = hits.points(self.mesh)
        return points_of(self.networks, positions, hits, len(batch.origins)), positions

    def _color_loss(self, points: Points, batch: PixelBatch, moment: Moment) -> Tensor:
        """Eq. 1 in stage 1, eq. 14 in stage 2, eq. 13 in its last part (eq. 18, 20, 21)."""
        if moment.stage == 1:
            return self._error(self._pixel(points, visibility(points.alpha), batch, 1), batch)
        binary = self._error(self._pixel(points, visibility(points.binary_alpha), batch, SUBRAYS), batch)
        if moment.fine_tuning:
            return binary
        return 0.5 * binary + 0.5 * self._error(self._pixel(points, visibility(points.alpha), batch, SUBRAYS), batch)

    def _pixel(self, points: Points, weight: Tensor, batch: PixelBatch, subrays: int) -> Tensor:
        if subrays == 1:
            color, coverage = color_per_point(self.networks, points, weight, batch.centre_directions)
        else:
            color, coverage = color_per_pixel(self.networks, points, weight, batch.centre_directions, subrays)
        return color + (1.0 - coverage)[:, None] * self._background

    @staticmethod
    def _error(color: Tensor, batch: PixelBatch) -> Tensor:
        return (color - batch.color).square().mean()

    def _vertex_loss(self) -> Tensor:
        """Eq. 6, as a mean."""
        away = self.mesh.offsets.abs()
        outside = (away.detach() > 0.5).to(away.dtype)
        return ((numbers.VERTEX_OUTSIDE * outside + numbers.VERTEX_PULL) * away).mean()

    def _optimise(self, loss: Tensor, moment: Moment) -> None:
        for group in self._adam.param_groups:
            group["lr"] = moment.rate * group["factor"]
        self._adam.zero_grad(set_to_none=True)
        if loss.requires_grad:  # no ray may have met anything
            loss.backward()
        if moment.fine_tuning:  # V, A and G are fixed
            for parameter in (*self.networks.A.parameters(), *self.grid.parameters(), self.mesh.offsets):
                parameter.grad = None
        self._adam.step()
        with torch.no_grad():
            self.mesh.offsets.clamp_(-0.5, 0.5)

    @torch.no_grad()
    def held_out_psnr(self, moment: Moment, count: int) -> float:
        """PSNR (dB) of `count` random pixels of the held-out views: of the continuous model in stage 1, else binary."""
        pixels = Pixels(self.capture.test, self.cube, self.capture.background, self.device)
        rng, errors = np.random.default_rng(self.seed), []
        subrays = 1 if moment.stage == 1 else SUBRAYS
        for first in range(0, count, RAYS_AT_ONCE // subrays):
            some = min(RAYS_AT_ONCE // subrays, count - first)
            batch = pixels.draw(rng, some, supersampled=subrays > 1)
            points, _ = self._points(batch, self._keep(moment), self._nonempty(moment))
            alpha = points.alpha if moment.stage == 1 else points.binary_alpha
            color = self._pixel(points, visibility(alpha), batch, subrays)
            errors.append((color - batch.color).square().mean(1).cpu().numpy())
        return psnr_of(np.concatenate(errors).tolist())
