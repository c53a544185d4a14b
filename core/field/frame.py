"""The training frame: the scene moved and scaled into the cube [-1, 1]^3, whatever its size and place."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
import warp as wp
from torch import Tensor

from core.camera import Camera
from core.kernels.camera_rays import CameraArray


@dataclass(frozen=True)
class Frame:
    """cube = (object - centre) / half.

    Attributes:
        centre: [3] float64, object frame.
        half: half the cube's edge, object units, > 0.
    """

    centre: np.ndarray
    half: float

    def to_cube(self, points: np.ndarray) -> np.ndarray:
        return (points - self.centre) / self.half

    def to_object(self, points: np.ndarray) -> np.ndarray:
        return np.asarray(points, np.float64) * self.half + self.centre

    def camera_array(self, cameras: Sequence[Camera], device: str) -> CameraArray:
        """The cameras as kernels read them, in the cube's frame."""
        array = CameraArray()
        columns = {
            "focal_px": (np.array([c.focal_px for c in cameras]), wp.vec2),
            "centre_px": (np.array([c.centre_px for c in cameras]), wp.vec2),
            "rotation": (np.array([c.world_from_camera[:3, :3] for c in cameras]), wp.mat33),
            "position": (self.to_cube(np.array([c.position for c in cameras])), wp.vec3),
        }
        for name, (values, dtype) in columns.items():
            setattr(array, name, wp.array(values.astype(np.float32), dtype=dtype, device=device))
        return array


def as_vec3(tensor: Tensor) -> Any:
    return wp.from_torch(tensor, dtype=wp.vec3)


def empty(*shape: int, device: str, dtype: torch.dtype = torch.float32) -> Tensor:
    return torch.empty(shape, dtype=dtype, device=device)
