"""A room's corner with patterned walls, photographed by cameras that we know: seconds to render, easy to pose."""

from pathlib import Path

import numpy as np
from PIL import Image

from core.camera import Camera

SIZE_PX = (320, 240)
FOCAL_PX = 330.0
TEXTURE_PX = 1024
WALL = 4.0  # side of floor and walls


def write_photos(folder: Path, count: int = 8, **changes: float) -> list[Camera]:
    """Writes 0.png, 1.png ... and returns their cameras."""
    folder.mkdir(parents=True, exist_ok=True)
    cameras = arc(count, **changes)
    for camera in cameras:
        Image.fromarray(photo(camera)).save(folder / f"{camera.name}.png")
    return cameras


def arc(count: int, step_rad: float = 0.12, size_px: tuple[int, int] = SIZE_PX) -> list[Camera]:
    """Cameras on an arc, all looking into the corner."""
    angles = np.pi / 4 + step_rad * (np.arange(count) - (count - 1) / 2)
    places = [3.4 * np.array([np.cos(a), np.sin(a), 0.35 + 0.03 * i]) for i, a in enumerate(angles)]
    return [_camera(str(i), place, size_px) for i, place in enumerate(places)]


def photo(camera: Camera) -> np.ndarray:
    """[h, w, 3] uint8."""
    rays = camera.directions(camera.pixel_centres())
    nearest = np.full(rays.shape[:2], np.inf)
    image = np.zeros(rays.shape)
    for axis, texture in enumerate(_textures()):
        with np.errstate(divide="ignore"):
            distance = -camera.position[axis] / rays[..., axis]
        hit = camera.position + distance[..., None] * rays
        across = np.delete(hit, axis, -1)
        on_wall = (distance > 0) & (distance < nearest) & ((across >= 0) & (across < WALL)).all(-1)
        nearest = np.where(on_wall, distance, nearest)
        image[on_wall] = _sampled(texture, across[on_wall] / WALL)
    return np.rint(image).astype(np.uint8)


def _camera(name: str, position: np.ndarray, size_px: tuple[int, int]) -> Camera:
    backward = position - np.array([0.6, 0.6, 0.5])
    backward /= np.linalg.norm(backward)
    right = np.cross([0.0, 0.0, 1.0], backward)
    right /= np.linalg.norm(right)
    pose = np.eye(4)
    pose[:3] = np.stack([right, np.cross(backward, right), backward, position], -1)
    focal = FOCAL_PX * size_px[0] / SIZE_PX[0]
    return Camera(name, pose, (focal, focal), (size_px[0] / 2, size_px[1] / 2), size_px)


def _textures() -> list[np.ndarray]:
    """Three [TEXTURE_PX, TEXTURE_PX, 3] float64 of blots in many sizes."""
    rng = np.random.default_rng(7)
    textures = []
    for _ in range(3):
        texture = np.zeros((TEXTURE_PX, TEXTURE_PX, 3))
        for cells in (8, 32, 64, 128):
            blots = Image.fromarray(rng.integers(0, 256, (cells, cells, 3), np.uint8))
            texture += np.asarray(blots.resize((TEXTURE_PX, TEXTURE_PX), Image.Resampling.BICUBIC), np.float64)
        textures.append(np.clip((texture / 4 - 127.5) * 2 + 127.5, 0, 255))
    return textures


def _sampled(texture: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Bilinear, at [n, 2] in [0, 1)."""
    place = at * (TEXTURE_PX - 1)
    low = np.floor(place).astype(int)
    share = (place - low)[..., None]
    corner = [[texture[low[:, 0] + i, low[:, 1] + j] for j in (0, 1)] for i in (0, 1)]
    rows = [corner[i][0] * (1 - share[:, 1]) + corner[i][1] * share[:, 1] for i in (0, 1)]
    return rows[0] * (1 - share[:, 0]) + rows[1] * share[:, 0]
