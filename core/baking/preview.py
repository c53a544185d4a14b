"""Small pictures of what there is so far."""

from collections.abc import Sequence

import numpy as np
import torch
from torch import nn

from core.baked import BakedScene
from core.camera import Camera
from core.field.frame import Frame
from core.field.network import shade
from core.field.voxels import VoxelField
from core.render.composite import over, quantised
from core.render.raster import Rasteriser
from core.training.marcher import Marcher
from core.training.pixels import camera_rays_of

PREVIEW_SIZE_PX = 200
RAYS_AT_ONCE = 8192


def preview_of_scene(scene: BakedScene, camera: Camera, device: str) -> np.ndarray:
    """[h, w, 3] uint8, at most 200 px a side."""
    return quantised(over(Rasteriser(scene, device).deferred(_small(camera)), scene.background))


def preview_of_field(
    field: VoxelField,
    network: nn.Sequential,
    camera: Camera,
    frame: Frame,
    background: Sequence[float],
    device: str,
) -> np.ndarray:
    """[h, w, 3] uint8, at most 200 px a side: the voxel field, one ray a pixel."""
    small = _small(camera)
    origins, directions = camera_rays_of(small, frame, device)
    marcher, parts = Marcher(field, device), []
    for o, d in zip(origins.split(RAYS_AT_ONCE), directions.split(RAYS_AT_ONCE), strict=True):
        F, A = marcher.forward(o.contiguous(), d.contiguous(), torch.full((len(o),), 0.5, device=device))
        with torch.no_grad():
            color = shade(network, F, A, frame.directions_to_object(d)) + (1.0 - A)[:, None] * torch.tensor(
                background, device=device
            )
        parts.append(color)
    width, height = small.size_px
    return quantised(torch.cat(parts).reshape(height, width, 3).cpu().numpy())


def _small(camera: Camera) -> Camera:
    share = min(1.0, PREVIEW_SIZE_PX / max(camera.size_px))
    return camera.resized((max(1, round(camera.size_px[0] * share)), max(1, round(camera.size_px[1] * share))))
