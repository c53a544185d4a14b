"""Where the sample is photographed from."""

from __future__ import annotations

import numpy as np

from core.camera import Camera

DISTANCE = 4.03  # NeRF-synthetic's, to the origin
CAMERA_ANGLE_X = 0.69
UP = np.array([0.0, 0.0, 1.0])


def hemisphere_cameras(count: int, size_px: int, seed: int) -> list[Camera]:
    """Cameras all over the upper hemisphere and a little below the table's edge, well spread with some jitter."""
    rng = np.random.default_rng([seed, 2])
    index = np.arange(count)
    height = np.clip((index + 0.5) / count * 1.02 - 0.06 + rng.uniform(-0.3, 0.3, count) / count, -0.06, 0.97)
    heading = index * np.pi * (3 - np.sqrt(5)) + rng.uniform(0, 2 * np.pi) + rng.uniform(-0.15, 0.15, count)
    return [_camera(f"r_{i}", h, np.arcsin(z), size_px) for i, (h, z) in enumerate(zip(heading, height, strict=True))]


def orbit_cameras(count: int, size_px: int, seed: int) -> list[Camera]:
    """Cameras on one orbit, rising and falling, away from the training ones."""
    start = np.random.default_rng([seed, 3]).uniform(0, 2 * np.pi)
    turn = (np.arange(count) + 0.5) / count * 2 * np.pi
    return [_camera(f"r_{i}", start + t, 0.48 + 0.22 * np.sin(2 * t), size_px) for i, t in enumerate(turn)]


def look_at_origin(position: np.ndarray) -> np.ndarray:
    """world_from_camera [4, 4] of an upright camera that looks at the origin."""
    backward = position / np.linalg.norm(position)
    right = np.cross(UP, backward)
    right /= np.linalg.norm(right)
    pose = np.eye(4)
    pose[:3] = np.stack([right, np.cross(backward, right), backward, position], -1)
    return pose


def _camera(name: str, heading: float, elevation: float, size_px: int) -> Camera:
    cos = np.cos(elevation)
    position = DISTANCE * np.array([cos * np.cos(heading), cos * np.sin(heading), np.sin(elevation)])
    focal = 0.5 * size_px / np.tan(0.5 * CAMERA_ANGLE_X)
    return Camera(name, look_at_origin(position), (focal, focal), (size_px / 2, size_px / 2), (size_px, size_px))
