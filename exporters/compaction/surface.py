"""What is seen of a scene, as a sample: texels, and the directions they are looked at from."""

from dataclasses import dataclass

import numpy as np

from core.baked import BakedScene
from core.conventions import is_opaque

_SPIRAL = 32  # directions where the scene has no cameras


@dataclass(frozen=True)
class SurfacePoints:
    """Attributes:
    features_u8: uint8 [n, 8], opaque texels.
    directions: float64 [n, 3], unit, from a camera to the point.
    """

    features_u8: np.ndarray
    directions: np.ndarray


def surface_points(scene: BakedScene, count: int, seed: int = 0) -> SurfacePoints:
    """About `count` points spread evenly over the surface, each seen from one of the scene's cameras by turns."""
    rng = np.random.default_rng(seed)
    areas = [_areas(page.positions, page.triangles) for page in scene.pages]
    shares = np.array([area.sum() for area in areas])
    shares = shares / shares.sum() if shares.sum() > 0 else np.full(len(shares), 1 / len(shares))
    features, positions = [], []
    for page, area, share in zip(scene.pages, areas, shares, strict=True):
        chance = area / area.sum() if area.sum() > 0 else None
        triangle = page.triangles[rng.choice(len(area), int(np.ceil(share * count)), p=chance)]
        weights = _barycentric(rng, len(triangle))
        texcoords = np.einsum("nk,nkc->nc", weights, page.texcoords[triangle].astype(np.float64))
        height, width = page.features_u8.shape[:2]
        x, y = np.clip(np.floor(texcoords * (width, height)), 0, (width - 1, height - 1)).astype(np.int64).T
        features.append(page.features_u8[y, x])
        positions.append(np.einsum("nk,nkc->nc", weights, page.positions[triangle].astype(np.float64)))
    found, places = np.concatenate(features), np.concatenate(positions)
    opaque = is_opaque(found)
    return SurfacePoints(found[opaque], _directions(scene, places[opaque]))


def _areas(positions: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    corners = positions.astype(np.float64)[triangles]
    crossed = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    areas: np.ndarray = np.linalg.norm(crossed, axis=-1)
    return areas


def _barycentric(rng: np.random.Generator, count: int) -> np.ndarray:
    """[count, 3], uniform over the triangle."""
    a, b = rng.random((2, count))
    over = a + b > 1
    a, b = np.where(over, 1 - a, a), np.where(over, 1 - b, b)
    return np.stack([1 - a - b, a, b], -1)


def _directions(scene: BakedScene, places: np.ndarray) -> np.ndarray:
    turns = np.arange(len(places))
    if not scene.cameras:
        return _spiral()[turns % _SPIRAL]
    cameras = np.stack([camera.position for camera in scene.cameras])
    toward = places - cameras[turns % len(cameras)]
    length = np.linalg.norm(toward, axis=-1, keepdims=True)
    return np.where(length > 0, toward / np.maximum(length, 1e-300), [0.0, 0.0, 1.0])


def _spiral() -> np.ndarray:
    n = np.arange(_SPIRAL) + 0.5
    z, angle = 1 - 2 * n / _SPIRAL, np.pi * (1 + 5**0.5) * n
    radius = np.sqrt(1 - z * z)
    return np.stack([radius * np.cos(angle), radius * np.sin(angle), z], -1)
