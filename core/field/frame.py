"""The training frame: the scene moved, turned and scaled to where its parameterisation (space.py) expects it."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import torch
import warp as wp
from torch import Tensor

from core.camera import Camera
from core.kernels.camera_rays import CameraArray


@dataclass(frozen=True)
class Frame:
    """scene = rotation^T (object - centre) / half.

    Attributes:
        centre: [3] float64, object frame.
        half: what becomes 1 (half a cube's edge, the nearest depth), object units, > 0.
        rotation: [3, 3] float64, its columns are the scene's axes in the object frame.
    """

    centre: np.ndarray
    half: float
    rotation: np.ndarray = field(default_factory=lambda: np.eye(3))

    def to_scene(self, points: np.ndarray) -> np.ndarray:
        return (points - self.centre) @ self.rotation / self.half

    def to_object(self, points: np.ndarray) -> np.ndarray:
        return (np.asarray(points, np.float64) * self.half) @ self.rotation.T + self.centre

    def directions_to_object(self, directions: Tensor) -> Tensor:
        """The network sees directions in the object frame, as the viewers do."""
        if np.array_equal(self.rotation, np.eye(3)):
            return directions
        turn = torch.from_numpy(self.rotation.T.astype(np.float32)).to(directions.device)
        return directions @ turn

    def camera_array(self, cameras: Sequence[Camera], device: str) -> CameraArray:
        """The cameras as kernels read them, in the scene's frame."""
        array = CameraArray()
        columns = {
            "focal_px": (np.array([c.focal_px for c in cameras]), wp.vec2),
            "centre_px": (np.array([c.centre_px for c in cameras]), wp.vec2),
            "rotation": (np.array([self.rotation.T @ c.world_from_camera[:3, :3] for c in cameras]), wp.mat33),
            "position": (self.to_scene(np.array([c.position for c in cameras])), wp.vec3),
        }
        for name, (values, dtype) in columns.items():
            setattr(array, name, wp.array(values.astype(np.float32), dtype=dtype, device=device))
        return array


def as_vec3(tensor: Tensor) -> Any:
    return wp.from_torch(tensor, dtype=wp.vec3)


def empty(*shape: int, device: str, dtype: torch.dtype = torch.float32) -> Tensor:
    return torch.empty(shape, dtype=dtype, device=device)
