"""Pixels of photos, with the rays through them."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from benchmarks.reference_setting.cube import Cube
from core.capture import View
from core.conventions import SUBPIXEL_OFFSETS_PX


@dataclass(frozen=True)
class PixelBatch:
    """Attributes:
    origins, directions: [n * subrays, 3] in the cube's frame, a pixel's sub-rays together.
    centre_directions: [n, 3]; color: [n, 3], the photo over the background.
    """

    origins: Tensor
    directions: Tensor
    centre_directions: Tensor
    color: Tensor


class Pixels:
    """All pixels of some views, to be drawn from at random."""

    def __init__(self, views: Sequence[View], cube: Cube, background: Sequence[float], device: str) -> None:
        self.device, self._views, self._cube = device, tuple(views), cube
        self._photos = [view.over(background).astype(np.float32) for view in views]
        sizes = [photo.shape[0] * photo.shape[1] for photo in self._photos]
        self._starts = np.concatenate([[0], np.cumsum(sizes)])

    def draw(self, rng: np.random.Generator, count: int, *, supersampled: bool) -> PixelBatch:
        """`count` pixels, each through its centre or through its four sub-pixels."""
        index = np.sort(rng.integers(0, self._starts[-1], count))
        offsets = SUBPIXEL_OFFSETS_PX if supersampled else np.zeros((1, 2))
        parts = []
        for k in np.unique(np.searchsorted(self._starts, index, side="right") - 1):
            local = index[(index >= self._starts[k]) & (index < self._starts[k + 1])] - self._starts[k]
            parts.append(self._rays(int(k), local, offsets))
        return PixelBatch(*(self._tensor(np.concatenate(column)) for column in zip(*parts, strict=True)))

    def _rays(self, k: int, local: np.ndarray, offsets: np.ndarray) -> tuple[np.ndarray, ...]:
        camera, photo = self._views[k].camera, self._photos[k]
        row, column = np.divmod(local, photo.shape[1])
        centre = np.stack([column, row], -1) + 0.5
        directions = camera.directions(centre[:, None, :] + offsets).reshape(-1, 3)
        origins = np.broadcast_to(self._cube.to_cube(camera.position), directions.shape)
        return origins, directions, camera.directions(centre), photo[row, column]

    def _tensor(self, values: np.ndarray) -> Tensor:
        return torch.from_numpy(values.astype(np.float32)).to(self.device)
