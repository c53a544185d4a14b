"""Small baked scenes made by hand, for tests of every part: no training, no files, deterministic from a seed."""

import numpy as np

from core.baked import LAYER_SHAPES, BakedScene, Page, ShaderNetwork
from core.camera import Camera
from core.conventions import ASSET_FROM_Z_UP, bytes_from_features, feature_from_byte

PATCH_PX = 9  # texels of a quad's edge; odd, so that patches do not line up with the page's binary grid


def tiny_scene() -> BakedScene:
    """48 quads on a bent sheet over two pages of unlike, non-square sizes, with holes; three cameras."""
    rng = np.random.default_rng(7)
    quads = _sheet_quads(6, 8)
    network = random_network(rng)
    pages = (
        _page(quads[:30], (64, 128), network, rng),
        _page(quads[30:], (128, 64), network, rng),
    )
    cameras = (
        look_at_camera("front", (0.4, -2.2, 0.9), size_px=(160, 120)),
        look_at_camera("side", (2.0, 0.5, 0.6), size_px=(128, 128)),
        Camera("off centre", _look_at(np.array([-1.3, -1.6, 1.2])), (150.5, 149.0), (70.25, 66.5), (144, 128)),
    )
    return BakedScene(pages, network, (1.0, 1.0, 1.0), ASSET_FROM_Z_UP.copy(), cameras)


def random_scene(rng: np.random.Generator, quads: int = 40) -> BakedScene:
    """`quads` loose quads, random within the unit ball, on one page; they may intersect. One camera."""
    centres = _random_directions(rng, quads) * rng.uniform(0.1, 0.8, (quads, 1))
    u, v = _random_directions(rng, quads), _random_directions(rng, quads)
    v -= (u * v).sum(-1, keepdims=True) * u
    v /= np.linalg.norm(v, axis=-1, keepdims=True)
    half = rng.uniform(0.05, 0.25, (quads, 1))
    corners = np.stack([centres + half * (a * u + b * v) for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1))], 1)
    corners += rng.normal(0, 0.02, corners.shape)  # not planar
    network = random_network(rng)
    side = 1
    while (side // PATCH_PX) ** 2 < quads:
        side *= 2
    page = _page(corners, (side, side), network, rng)
    camera = look_at_camera("random", _random_directions(rng, 1)[0] * 2.5, size_px=(96, 80))
    return BakedScene((page,), network, tuple(rng.uniform(0, 1, 3)), ASSET_FROM_Z_UP.copy(), (camera,))


def random_network(rng: np.random.Generator, gain: float = 1.0) -> ShaderNetwork:
    """A network whose colours vary over the whole range; `gain` scales every number (1e3 and up saturates it)."""
    weights = [rng.normal(0, gain * 1.6 / np.sqrt(columns), (rows, columns)) for rows, columns in LAYER_SHAPES]
    biases = [rng.normal(0, gain * 0.2, rows) for rows, _ in LAYER_SHAPES]
    w0, w1, w2 = (w.astype(np.float32) for w in weights)
    b0, b1, b2 = (b.astype(np.float32) for b in biases)
    return ShaderNetwork((w0, w1, w2), (b0, b1, b2))


def look_at_camera(name: str, position: tuple[float, float, float] | np.ndarray, *, size_px: tuple[int, int]) -> Camera:
    """A camera at `position` that looks at the origin, +z up, about 45 degrees wide."""
    width, height = size_px
    focal = 1.2 * width
    return Camera(name, _look_at(np.asarray(position, float)), (focal, focal), (width / 2, height / 2), size_px)


def _look_at(position: np.ndarray) -> np.ndarray:
    """[4, 4] world_from_camera, OpenGL axes, looking at the origin."""
    back = position / np.linalg.norm(position)
    right = np.cross([0.0, 0.0, 1.0], back)
    right /= np.linalg.norm(right)
    matrix = np.eye(4)
    matrix[:3, :3] = np.stack([right, np.cross(back, right), back], 1)
    matrix[:3, 3] = position
    return matrix


def _sheet_quads(rows: int, columns: int) -> np.ndarray:
    """[rows * columns, 4, 3]: a connected sheet bent around the z axis."""
    i, j = np.meshgrid(np.arange(rows + 1) / rows, np.arange(columns + 1) / columns, indexing="ij")
    angle = (j - 0.5) * 3.6
    radius = 0.6 + 0.15 * np.sin(5 * i + 3 * j)
    grid = np.stack([radius * np.sin(angle), -radius * np.cos(angle), 1.1 * (i - 0.5)], -1)
    corners = np.stack([grid[:-1, :-1], grid[:-1, 1:], grid[1:, 1:], grid[1:, :-1]], 2)
    return corners.reshape(-1, 4, 3)


def _random_directions(rng: np.random.Generator, count: int) -> np.ndarray:
    d = rng.normal(size=(count, 3))
    return d / np.linalg.norm(d, axis=-1, keepdims=True)


def _page(corners: np.ndarray, size: tuple[int, int], network: ShaderNetwork, rng: np.random.Generator) -> Page:
    """A page of `size` (height, width) with one patch per quad of `corners` [Q, 4, 3]."""
    height, width = size
    per_row = width // PATCH_PX
    assert len(corners) <= per_row * (height // PATCH_PX), "page too small"
    features_u8 = np.zeros((height, width, 8), np.uint8)
    texcoords = []
    for index in range(len(corners)):
        top, left = index // per_row * PATCH_PX, index % per_row * PATCH_PX
        features_u8[top : top + PATCH_PX, left : left + PATCH_PX] = _patch(rng)
        # Half a texel inset, so that the corners are texel centres.
        x0, x1 = (left + 0.5) / width, (left + PATCH_PX - 0.5) / width
        y0, y1 = (top + 0.5) / height, (top + PATCH_PX - 0.5) / height
        texcoords += [[x0, y0], [x1, y0], [x1, y1], [x0, y1]]
    two_triangles = np.array([[0, 1, 2], [0, 2, 3]])
    triangles = (4 * np.arange(len(corners))[:, None, None] + two_triangles).reshape(-1, 3)
    return Page(
        features_u8,
        _mean_colors(features_u8, network),
        corners.reshape(-1, 3).astype(np.float32),
        np.array(texcoords, np.float32),
        triangles.astype(np.uint32),
    )


def _patch(rng: np.random.Generator) -> np.ndarray:
    """[PATCH_PX, PATCH_PX, 8] uint8: smooth random features; some patches have a hole."""
    t = np.linspace(0, 1, PATCH_PX)
    y, x = np.meshgrid(t, t, indexing="ij")
    a, b, c, d = rng.uniform(0, 1, (4, 8))
    features = (1 - x)[..., None] * ((1 - y)[..., None] * a + y[..., None] * b)
    features += x[..., None] * ((1 - y)[..., None] * c + y[..., None] * d)
    features += rng.normal(0, 0.02, features.shape)
    hole_x, hole_y = rng.uniform(0, 1, 2)
    radius = rng.choice([0.0, 0.25])
    opaque = np.hypot(x - hole_x, y - hole_y) >= radius
    return bytes_from_features(features, opaque)


def _mean_colors(features_u8: np.ndarray, network: ShaderNetwork) -> np.ndarray:
    """[h, w, 3] uint8: the network's colour averaged over the six axis directions; zero in holes."""
    features = feature_from_byte(features_u8)
    axes = np.concatenate([np.eye(3), -np.eye(3)])
    mean = np.mean([network(features, np.broadcast_to(d, (*features.shape[:2], 3))) for d in axes], 0)
    return np.where(features_u8[..., :1] > 0, np.rint(mean * 255), 0).astype(np.uint8)
