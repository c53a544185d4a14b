"""Captures of nothing but cameras: grey photos, whose poses are what matters."""

from collections.abc import Sequence

import numpy as np

from core.camera import Camera
from core.capture import Capture, View

SIZE_PX = (8, 6)


def facing(position: Sequence[float], forward: Sequence[float], up: Sequence[float] = (0, 0, 1)) -> np.ndarray:
    """[4, 4] world_from_camera of a camera that looks along `forward`, upright."""
    back = -np.asarray(forward, float) / np.linalg.norm(forward)
    right = np.cross(up, back)
    right /= np.linalg.norm(right)
    matrix = np.eye(4)
    matrix[:3] = np.stack([right, np.cross(back, right), back, position], 1)
    return matrix


def view_at(pose: np.ndarray, name: str = "", channels: int = 3, depth_range=None) -> View:
    camera = Camera(name, pose, (8.0, 8.0), (4.0, 3.0), SIZE_PX)
    return View(camera, np.full((SIZE_PX[1], SIZE_PX[0], channels), 128, np.uint8), depth_range=depth_range)


def capture_of(poses: Sequence[np.ndarray], **options) -> Capture:
    """All poses but the last are trained on."""
    options = {"channels": 3, "depth_range": None, **options}
    channels, depth_range = options.pop("channels"), options.pop("depth_range")
    views = [view_at(pose, str(i), channels, depth_range) for i, pose in enumerate(poses)]
    return Capture(tuple(views[:-1]), tuple(views[-1:]), **options)


def ring(count: int = 9, radius: float = 3.0, height: float = 1.0, arc: float = 2 * np.pi) -> list[np.ndarray]:
    """Cameras that look at the origin from a horizontal ring; with an arc, from around -y."""
    angles = np.arange(count) / count * arc - arc * (count - 1) / (2 * count) - np.pi / 2
    positions = [(radius * np.cos(a), radius * np.sin(a), height) for a in angles]
    return [facing(position, -np.array(position)) for position in positions]


def row(count: int = 5, step: float = 0.3) -> list[np.ndarray]:
    """Cameras side by side, axes parallel along +y."""
    return [facing(((i - (count - 1) / 2) * step, 0, 0), (0, 1, 0)) for i in range(count)]


def moved(poses: Sequence[np.ndarray], scale: float = 1.0, rotation: np.ndarray | None = None, shift=(0, 0, 0)):
    """The same cameras in a frame that is scaled, then turned, then shifted."""
    rotation = np.eye(3) if rotation is None else rotation
    result = []
    for pose in poses:
        matrix = np.eye(4)
        matrix[:3, :3] = rotation @ pose[:3, :3]
        matrix[:3, 3] = scale * (rotation @ pose[:3, 3]) + shift
        result.append(matrix)
    return result


def random_rotation(seed: int) -> np.ndarray:
    rotation, _ = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))
    return rotation * np.sign(np.linalg.det(rotation))
