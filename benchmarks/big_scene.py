"""A scene as large as assets get: 220,000 triangles on four pages of 4096², as trained ones look to a compressor.

Quads are cells of a sphere's surface, in layers; each has a patch of its own. Features change smoothly over a patch and
carry noise, a quarter of the quads are cut by an outline, and colours follow features. With `NOISE`, scene.glb takes 9
bytes a texel of its patches, as it does on lego at 400 px, where optimisers leave texels noisy.
"""

import numpy as np

from core.baked import LAYER_SHAPES, BakedScene, Page, ShaderNetwork
from core.camera import Camera
from core.conventions import ASSET_FROM_Z_UP, FEATURE_CHANNELS, MAX_PAGE_SIZE_PX, bytes_from_features

PAGES, PATCH_PX, QUADS_A_PAGE = 4, 24, 27_500
NOISE = 0.08
CUT = 4  # every so manieth quad has a hole
LAYERS = 10
QUADS_AT_ONCE = 2_000
_TRIANGLES = np.array([[0, 1, 2], [0, 2, 3]], np.uint32)


def big_scene(pages: int = PAGES, page_px: int = MAX_PAGE_SIZE_PX, quads: int = QUADS_A_PAGE) -> BakedScene:
    """Always the same scene; `quads` on each of `pages` pages."""
    rng = np.random.default_rng(0)
    corners = _corners(pages * quads)
    made = tuple(_page(rng, page_px, corners[first : first + quads]) for first in range(0, len(corners), quads))
    camera = Camera("front", _world_from_camera(), (1100.0, 1100.0), (400.0, 400.0), (800, 800))
    return BakedScene(made, _network(rng), (1.0, 1.0, 1.0), ASSET_FROM_Z_UP.copy(), (camera,))


def _corners(count: int) -> np.ndarray:
    """float32 [count, 4, 3]: cells of longitude and latitude on spheres within each other."""
    rows = int(np.ceil(np.sqrt(count / LAYERS / 2)))
    cell = np.arange(count)
    layer, cell = np.divmod(cell, 2 * rows * rows)
    row, column = np.divmod(cell, 2 * rows)
    steps = np.array([[0, 0], [1, 0], [1, 1], [0, 1]])
    longitude = np.pi * (column[:, None] + steps[:, 0]) / rows
    latitude = np.pi * ((row[:, None] + steps[:, 1]) / rows - 0.5) * 0.98
    radius = (1.0 - 0.02 * layer)[:, None]
    directions = [np.cos(latitude) * np.cos(longitude), np.cos(latitude) * np.sin(longitude), np.sin(latitude)]
    return np.stack([radius * direction for direction in directions], -1).astype(np.float32)


def _page(rng: np.random.Generator, page_px: int, corners: np.ndarray) -> Page:
    per_row = page_px // PATCH_PX
    assert len(corners) <= per_row**2, "page too small"
    features = np.zeros((page_px, page_px, FEATURE_CHANNELS), np.uint8)
    top, left = (PATCH_PX * place for place in np.divmod(np.arange(len(corners)), per_row))
    inside = np.arange(PATCH_PX)
    for first in range(0, len(corners), QUADS_AT_ONCE):
        some = slice(first, first + QUADS_AT_ONCE)
        rows = top[some, None, None] + inside[:, None]
        columns = left[some, None, None] + inside
        features[rows, columns] = _patches(rng, corners[some])
    colors = np.minimum(features[..., :3], features[..., 3:6])
    ends = np.array([[0, 0], [1, 0], [1, 1], [0, 1]]) * (PATCH_PX - 1)
    texcoords = (np.stack([left, top], -1)[:, None] + ends + 0.5) / page_px
    triangles = (4 * np.arange(len(corners), dtype=np.uint32)[:, None, None] + _TRIANGLES).reshape(-1, 3)
    return Page(features, colors, corners.reshape(-1, 3), texcoords.reshape(-1, 2).astype(np.float32), triangles)


def _patches(rng: np.random.Generator, corners: np.ndarray) -> np.ndarray:
    """uint8 [n, k, k, 8]."""
    waves = np.random.default_rng(1).normal(0, 2.0, (3, FEATURE_CHANNELS))  # the same for all
    at_corners = 0.5 + 0.35 * np.sin(corners @ waves)
    u = np.linspace(0, 1, PATCH_PX)[:, None]
    upper = at_corners[:, None, 0] * (1 - u) + at_corners[:, None, 1] * u
    lower = at_corners[:, None, 3] * (1 - u) + at_corners[:, None, 2] * u
    smooth = upper[:, None] * (1 - u[:, None]) + lower[:, None] * u[:, None]
    features = smooth + rng.normal(0, NOISE, smooth.shape)
    x, y = np.meshgrid(u[:, 0], u[:, 0])
    angle = rng.uniform(0, 2 * np.pi, (len(corners), 1, 1))
    beyond = (x - 0.5) * np.cos(angle) + (y - 0.5) * np.sin(angle) > 0.1
    cut = (np.arange(len(corners)) % CUT == 0)[:, None, None]
    return bytes_from_features(np.clip(features, 0, 1), ~(cut & beyond))


def _network(rng: np.random.Generator) -> ShaderNetwork:
    weights = tuple(rng.normal(0, 1.6 / np.sqrt(shape[1]), shape).astype(np.float32) for shape in LAYER_SHAPES)
    biases = tuple(rng.normal(0, 0.2, shape[0]).astype(np.float32) for shape in LAYER_SHAPES)
    return ShaderNetwork(weights, biases)  # type: ignore[arg-type]


def _world_from_camera() -> np.ndarray:
    """Four units before the sphere, along -y."""
    return np.array([[1, 0, 0, 0], [0, 0, -1, -4], [0, 1, 0, 0], [0, 0, 0, 1]], float)
