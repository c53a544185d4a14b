"""Where a voxel field has its surfaces, as seen from the training cameras."""

from collections.abc import Sequence

import numpy as np
import torch
import warp as wp
from torch import Tensor

from core.camera import Camera
from core.field.frame import Frame, as_vec3, empty
from core.field.space import CUBE, Space
from core.kernels.fusion import DepthPictures, fuse_depths, median_depth
from core.kernels.launch import launch
from core.training.marcher import Marcher
from core.training.pixels import camera_rays_of

# All pictures together: a mesh's cell then has 2 to 3 pixels each way. Four times as many gain nothing.
PIXELS = 3_000_000
RAYS_AT_ONCE = 16_384
# Distances are told apart up to one cell before and behind a surface. What a picture sees more than two cells before a
# point says nothing of it: that is how the back of a thin thing stays apart from its front.
BAND, HIDDEN = 1.0, 2.0


def depths_along(marcher: Marcher, origins: Tensor, directions: Tensor) -> Tensor:
    """[n] float32: distances along rays [n, 3] at which half of their light has ended, or FAR."""
    jitter = torch.full((len(origins),), 0.5, device=marcher.device)
    marcher.forward(origins, directions, jitter)
    return last_depths(marcher)


def last_depths(marcher: Marcher) -> Tensor:
    """As `depths_along`, of the marcher's last rays."""
    field = marcher.field
    depth = empty(len(marcher.samples.count), device=marcher.device)
    step = field.step if field.space.kind == CUBE else 0.0
    launch(median_depth, len(depth), [marcher.samples, step, wp.from_torch(depth)], marcher.device)
    return depth


def depth_pictures(marcher: Marcher, cameras: Sequence[Camera], frame: Frame) -> DepthPictures:
    """Pictures of the field from cameras, in the scene's frame, made smaller where there are many pixels."""
    device = marcher.device
    share = min(1.0, (PIXELS / sum(camera.size_px[0] * camera.size_px[1] for camera in cameras)) ** 0.5)
    small = [camera.resized(_scaled(camera.size_px, share)) for camera in cameras]
    pictures = [_picture(marcher, camera, frame) for camera in small]
    start = np.cumsum([0, *(len(picture) for picture in pictures[:-1])])
    made = DepthPictures()
    made.cameras = frame.camera_array(small, device)
    made.start = wp.array(start.astype(np.int32), dtype=wp.int32, device=device)
    made.size = wp.array(np.array([camera.size_px for camera in small], np.int32), dtype=wp.vec2i, device=device)
    made.depth = wp.from_torch(torch.cat(pictures))
    return made


class SurfaceDistance:
    """How far points lie before the surface that pictures agree on, in cells; see `fuse_depths`.

    Args:
        level: what counts as 0. Above 0, the surface lies outside of the one that half of the pictures would name.
    """

    def __init__(self, pictures: DepthPictures, space: Space, cells: int, device: str, level: float = 0.0) -> None:
        self._pictures, self._space, self._cells, self._device = pictures, space, cells, device
        self._level = level

    def __call__(self, places: np.ndarray) -> np.ndarray:
        """[n] float64 in [-1, 1] - level, of points [n, 3] of the cells' cube; where no picture knows, as inside."""
        distance, known = self.known(places)
        return np.where(known, distance, -1.0)

    def known(self, places: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(distances [n], whether any picture knows [n] bool)."""
        if len(places) == 0:  # Warp takes no empty arrays of vectors
            return np.zeros(0), np.zeros(0, bool)
        scene = self._space.cells_to_scene(places).astype(np.float32)
        points = torch.from_numpy(np.ascontiguousarray(scene)).to(self._device)
        distance, weight = (empty(len(points), device=self._device) for _ in range(2))
        band = BAND * 2.0 / self._cells
        inputs = [self._space.kernel_space(), self._pictures, as_vec3(points), band, HIDDEN / BAND,
                  wp.from_torch(distance), wp.from_torch(weight)]  # fmt: skip
        launch(fuse_depths, len(points), inputs, self._device)
        return distance.cpu().numpy().astype(np.float64) - self._level, weight.cpu().numpy() > 0


def _scaled(size_px: tuple[int, int], share: float) -> tuple[int, int]:
    return max(1, round(size_px[0] * share)), max(1, round(size_px[1] * share))


def _picture(marcher: Marcher, camera: Camera, frame: Frame) -> Tensor:
    """[h * w] depths."""
    origins, directions = camera_rays_of(camera, frame, marcher.device)
    n = len(origins)
    whole = -(-n // RAYS_AT_ONCE) * RAYS_AT_ONCE  # the marcher's buffers keep their size
    index = torch.arange(whole, device=marcher.device).clamp_max(n - 1)
    parts = [
        depths_along(marcher, origins[i].contiguous(), directions[i].contiguous()) for i in index.split(RAYS_AT_ONCE)
    ]
    return torch.cat(parts)[:n]
