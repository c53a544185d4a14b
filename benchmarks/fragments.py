"""Every fragment that a scene's triangles make of an image: what a GPU draws, not only what is in front.

Rays go through pixel centres, one a pixel. NumPy, float64, by the ray-triangle test of core/render/reference.py, on all
pairs of a triangle and a pixel of its bounding box at once.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from core.baked import BakedScene, Page
from core.camera import Camera
from core.conventions import is_opaque

PAIRS_AT_ONCE = 1 << 20


@dataclass(frozen=True)
class Fragments:
    """Attributes:
    size_px: (width, height).
    pixel: [n] flat index of each fragment's pixel.
    distance: [n] from the camera, along the ray; object units.
    opaque: [n] bool; the others are holes, which are drawn and discarded.
    """

    size_px: tuple[int, int]
    pixel: np.ndarray
    distance: np.ndarray
    opaque: np.ndarray

    def front(self) -> np.ndarray:
        """[height, width] distance of the nearest opaque fragment; infinite without any."""
        nearest = np.full(self._pixels, np.inf)
        np.minimum.at(nearest, self.pixel[self.opaque], self.distance[self.opaque])
        return self._image(nearest)

    def layers(self) -> np.ndarray:
        """[height, width] int, opaque fragments."""
        return self._image(np.bincount(self.pixel[self.opaque], minlength=self._pixels))

    def drawn(self) -> np.ndarray:
        """[height, width] int, all fragments."""
        return self._image(np.bincount(self.pixel, minlength=self._pixels))

    @property
    def _pixels(self) -> int:
        return self.size_px[0] * self.size_px[1]

    def _image(self, values: np.ndarray) -> np.ndarray:
        return values.reshape(self.size_px[1], self.size_px[0])


def fragments_of(scene: BakedScene, camera: Camera) -> Fragments:
    """All fragments of a scene seen by a camera."""
    parts = [part for page in scene.pages for part in _of_page(page, camera)]
    columns = zip(*parts, strict=True) if parts else ((), (), ())
    pixel, distance, opaque = (np.concatenate([np.zeros(0), *column]) for column in columns)
    return Fragments(camera.size_px, pixel.astype(np.int64), distance, opaque.astype(bool))


def _of_page(page: Page, camera: Camera) -> Iterator[tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """(pixel, distance, opaque) of some triangles at a time."""
    vertices = (page.positions.astype(np.float64) - camera.position) @ camera.world_from_camera[:3, :3]
    corners, texcoords = vertices[page.triangles], page.texcoords.astype(np.float64)[page.triangles]
    solid = is_opaque(page.features_u8)
    low, high = _boxes(corners, camera)
    counts = np.prod(np.maximum(high - low, 0), -1)
    visible = np.flatnonzero(counts)
    ends = np.cumsum(counts[visible])
    for some in np.split(
        visible, np.searchsorted(ends, np.arange(PAIRS_AT_ONCE, ends[-1] if len(ends) else 0, PAIRS_AT_ONCE))
    ):
        if len(some):
            yield _of_triangles(corners[some], texcoords[some], low[some], high[some], solid, camera)


def _of_triangles(
    corners: np.ndarray, texcoords: np.ndarray, low: np.ndarray, high: np.ndarray, solid: np.ndarray, camera: Camera
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    triangle, x, y = _pairs(low, high)
    ray = _rays(x, y, camera)
    normals = np.cross(np.roll(corners, -1, 1), np.roll(corners, -2, 1))
    b = np.einsum("nij,nj->ni", normals[triangle], ray)
    total = b.sum(-1)
    inside = ((b >= 0).all(-1) | (b <= 0).all(-1)) & (total != 0)
    triangle, x, y, ray, b, total = (a[inside] for a in (triangle, x, y, ray, b, total))
    depth = np.einsum("nj,nj->n", corners[triangle, 0], normals[triangle, 0]) / total
    ahead = depth > 0
    triangle, x, y, ray, depth = (a[ahead] for a in (triangle, x, y, ray, depth))
    place = np.einsum("ni,nij->nj", b[ahead] / total[ahead, None], texcoords[triangle])
    size = np.array([solid.shape[1], solid.shape[0]])
    texel = np.clip(np.floor(place * size), 0, size - 1).astype(int)
    pixel = y * camera.size_px[0] + x
    return pixel, depth * np.linalg.norm(ray, axis=-1), solid[texel[:, 1], texel[:, 0]]


def _rays(x: np.ndarray, y: np.ndarray, camera: Camera) -> np.ndarray:
    """[n, 3] in the camera frame, through pixel centres, with z = -1."""
    right = (x + 0.5 - camera.centre_px[0]) / camera.focal_px[0]
    down = (y + 0.5 - camera.centre_px[1]) / camera.focal_px[1]
    return np.stack([right, -down, -np.ones(len(x))], -1)


def _boxes(corners: np.ndarray, camera: Camera) -> tuple[np.ndarray, np.ndarray]:
    """(first [T, 2], one past the last [T, 2]) pixel (x, y) that triangles may cover; all where a corner is behind."""
    depth = -corners[..., 2:]
    offset = corners[..., :2] * np.array([1.0, -1.0])
    with np.errstate(divide="ignore", invalid="ignore"):
        projected = np.array(camera.centre_px) + np.array(camera.focal_px) * offset / depth
    ahead, somewhere = np.all(depth > 0, (1, 2)), np.any(depth > 0, (1, 2))
    size = np.array(camera.size_px)
    low = np.where(ahead[:, None], projected.min(1), 0.0)
    high = np.where(ahead[:, None], projected.max(1), size)
    low, high = np.clip(np.floor(low) - 1, 0, size), np.clip(np.ceil(high) + 1, 0, size)
    return low.astype(int), np.where(somewhere[:, None], high, low).astype(int)


def _pairs(low: np.ndarray, high: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(triangle, x, y) of every pixel of every box."""
    width = high[:, 0] - low[:, 0]
    counts = width * (high[:, 1] - low[:, 1])
    triangle = np.repeat(np.arange(len(low)), counts)
    local = np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
    row, column = np.divmod(local, width[triangle])
    return triangle, low[triangle, 0] + column, low[triangle, 1] + row
