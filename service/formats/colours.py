"""What viewers show that know nothing of the network: a mesh with its plain texture, rendered without OpenGL.

A sample shows the nearest opaque texel's triangle; colour is nearest, or interpolated between four texels in linear
light, as viewers do with sRGB textures. No mip maps: four samples a pixel take their place.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal

import numpy as np

from core.baked import LAYER_SHAPES, BakedScene, Page, ShaderNetwork
from core.camera import Camera
from core.conventions import FEATURE_CHANNELS
from core.render.raster import Rasteriser
from core.render.visibility import Visibility, pixel_means, subpixel_camera

ALPHA_CUTOFF_U8 = 128  # as glTF's alphaCutoff and USD's opacityThreshold of a half
SAMPLES_AT_ONCE = 1 << 18  # 100 MB of intermediate results
NO_NETWORK = ShaderNetwork(
    tuple(np.zeros(shape, np.float32) for shape in LAYER_SHAPES),  # type: ignore[arg-type]
    tuple(np.zeros(rows, np.float32) for rows, _ in LAYER_SHAPES),  # type: ignore[arg-type]
)
# (texture, positions, texcoords, triangles); the last three as of core.baked.Page.
Textured = tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]


def scene_of_colours(meshes: Iterable[Textured], asset_from_object: np.ndarray) -> BakedScene:
    """Meshes with RGBA textures [h, w, 4] uint8 as pages that have opacity and colours, and no features.

    Raises:
        SceneInvalid: the textures' sizes are no powers of two, and so on.
    """
    pages = []
    for rgba_u8, positions, texcoords, triangles in meshes:
        features_u8 = np.zeros((*rgba_u8.shape[:2], FEATURE_CHANNELS), np.uint8)
        features_u8[..., 0] = np.where(rgba_u8[..., 3] >= ALPHA_CUTOFF_U8, np.uint8(255), np.uint8(0))
        pages.append(Page(features_u8, np.ascontiguousarray(rgba_u8[..., :3]), positions, texcoords, triangles))
    return BakedScene(tuple(pages), NO_NETWORK, (1.0, 1.0, 1.0), asset_from_object)


@dataclass(frozen=True)
class Coloured:
    """What was read of a file that holds colours and no network.

    Attributes:
        scene: pages with opacity and colours; features and network mean nothing.
        frame: that the vertices are in: the scene's own object frame, or the asset's.
        smooth: the texture is interpolated between texels.
        vertex_colors_u8: uint8 [V, 3] of each page, in place of a texture.
    """

    scene: BakedScene
    frame: Literal["object", "asset"]
    smooth: bool = True
    vertex_colors_u8: tuple[np.ndarray, ...] = ()


class ColourRenderer:
    """Renders colours.

    Args:
        held: what to render.
        device: of the rasteriser.
    """

    def __init__(self, held: Coloured, device: str = "cpu") -> None:
        self._held = held
        self._rasteriser = Rasteriser(held.scene, device)

    def image(self, camera: Camera) -> np.ndarray:
        """[h, w, 4] float32 in [0, 1]: colour (sRGB), premultiplied by coverage, and coverage; 2 x 2 samples a pixel.

        `camera` is in the frame of the vertices.
        """
        samples = subpixel_camera(camera)
        seen = self._rasteriser.visibility(samples)
        rgba = np.zeros((*seen.page.shape, 4), np.float32)
        rgba[..., 3] = seen.hit
        for number in range(len(self._held.scene.pages)):
            rows, columns = np.nonzero(seen.page == number)
            for part in np.array_split(np.arange(len(rows)), len(rows) // SAMPLES_AT_ONCE + 1):
                at = rows[part], columns[part]
                rgba[(*at, slice(3))] = self._colors(number, seen, samples, at) / 255.0
        return pixel_means(rgba)

    def _colors(self, number: int, seen: Visibility, camera: Camera, at: tuple[np.ndarray, np.ndarray]) -> np.ndarray:
        """[n, 3] in 0..255 of samples (row, column) that see page `number`."""
        page = self._held.scene.pages[number]
        if not self._held.smooth:
            return page.colors_u8[seen.row[at], seen.column[at]]
        vertices = page.triangles[seen.triangle[at]]
        weights = _barycentric(page.positions[vertices], camera, at)
        if self._held.vertex_colors_u8:
            return _mixed(weights, self._held.vertex_colors_u8[number][vertices])
        return _interpolated(page.colors_u8, _mixed(weights, page.texcoords[vertices]))


def _barycentric(corners: np.ndarray, camera: Camera, at: tuple[np.ndarray, np.ndarray]) -> np.ndarray:
    """[n, 3] where rays through pixels (row, column) meet triangles [n, 3, 3]; as in core/render/reference.py."""
    directions = camera.directions(np.stack([at[1], at[0]], -1) + 0.5)
    corners = corners.astype(np.float64) - camera.position
    normals = np.cross(np.roll(corners, -1, 1), np.roll(corners, -2, 1))
    weights = np.einsum("nc,nkc->nk", directions, normals)
    found: np.ndarray = weights / weights.sum(-1, keepdims=True)
    return found


def _mixed(weights: np.ndarray, values: np.ndarray) -> np.ndarray:
    """[n, c] of values [n, 3, c] at three corners."""
    found: np.ndarray = np.einsum("nk,nkc->nc", weights, values.astype(np.float64))
    return found


def _interpolated(texture_u8: np.ndarray, texcoords: np.ndarray) -> np.ndarray:
    """[n, 3] in 0..255, sRGB, of a texture [h, w, 3], clamped to its edge."""
    height, width = texture_u8.shape[:2]
    x, y = (texcoords * (width, height) - 0.5).T
    left, top = np.floor(x).astype(np.int64), np.floor(y).astype(np.int64)
    u, v = (x - left)[:, None], (y - top)[:, None]
    linear = np.zeros((len(x), 3))
    for dx, dy, weight in ((0, 0, (1 - u) * (1 - v)), (1, 0, u * (1 - v)), (0, 1, (1 - u) * v), (1, 1, u * v)):
        texels = texture_u8[np.clip(top + dy, 0, height - 1), np.clip(left + dx, 0, width - 1)]
        linear += weight * _LINEAR[texels]
    return 255.0 * _encoded(linear)


def _encoded(linear: np.ndarray) -> np.ndarray:
    """sRGB in [0, 1] of linear colour in [0, 1] (IEC 61966-2-1)."""
    return np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * np.maximum(linear, 0.0) ** (1 / 2.4) - 0.055)


def _decoded(srgb: np.ndarray) -> np.ndarray:
    return np.where(srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4)


_LINEAR = _decoded(np.arange(256) / 255.0)
