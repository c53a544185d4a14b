"""The baked scene: the one thing that exporters read and readers return. NumPy only."""

from dataclasses import dataclass, field

import numpy as np

from core.camera import Camera
from core.conventions import (
    FEATURE_CHANNELS,
    MAX_PAGE_SIZE_PX,
    NETWORK_HIDDEN,
    NETWORK_INPUTS,
    NETWORK_OUTPUTS,
)
from core.errors import SceneInvalid

LAYER_SHAPES = ((NETWORK_HIDDEN, NETWORK_INPUTS), (NETWORK_HIDDEN, NETWORK_HIDDEN), (NETWORK_OUTPUTS, NETWORK_HIDDEN))

SIMILARITY_TOLERANCE = 1e-6
SMALLEST_SCALE = 1e-18  # nanometres in light years; squares of it and of its inverse still fit float32


@dataclass(frozen=True)
class ShaderNetwork:
    """The deferred neural shader H of eq. 5: ReLU, ReLU, sigmoid.

    Input: 8 features in [0, 1], then the unit view direction. Output: sRGB in [0, 1].

    Attributes:
        weights: float32 matrices [16, 11], [16, 16], [3, 16]; a row is an output.
        biases: float32 vectors [16], [16], [3].
    """

    weights: tuple[np.ndarray, np.ndarray, np.ndarray]
    biases: tuple[np.ndarray, np.ndarray, np.ndarray]

    def __post_init__(self) -> None:
        shapes = tuple(np.shape(w) for w in self.weights)
        bias_shapes = tuple(np.shape(b) for b in self.biases)
        _require(shapes == LAYER_SHAPES, "network weights", f"must have shapes {LAYER_SHAPES}", str(shapes))
        expected = tuple((rows,) for rows, _ in LAYER_SHAPES)
        _require(bias_shapes == expected, "network biases", f"must have shapes {expected}", str(bias_shapes))
        numbers = np.concatenate([np.ravel(a) for a in (*self.weights, *self.biases)])
        _require(bool(np.isfinite(numbers).all()), "network", "must hold finite numbers only", "NaN or infinity")

    def __call__(self, features: np.ndarray, directions: np.ndarray) -> np.ndarray:
        """sRGB [..., 3] (float64) of features [..., 8] in [0, 1] seen along unit directions [..., 3] (object frame)."""
        x = np.concatenate([features, directions], -1).astype(np.float64)
        for weight, bias in zip(self.weights[:-1], self.biases[:-1], strict=True):
            x = np.maximum(x @ weight.T.astype(np.float64) + bias, 0.0)
        return _sigmoid(x @ self.weights[-1].T.astype(np.float64) + self.biases[-1])


@dataclass(frozen=True)
class Page:
    """One texture page and the triangles that use it.

    Attributes:
        features_u8: uint8 [height, width, 8]; sizes are powers of two, at most 4096. See conventions for the coding.
        colors_u8: uint8 [height, width, 3], sRGB: each opaque texel's colour averaged over the directions it was seen
            from. For viewers that cannot run the network.
        positions: float32 [V, 3], object frame.
        texcoords: float32 [V, 2] in [0, 1], (0, 0) at the page's top left corner.
        triangles: uint32 [T, 3], two per quad, visible from both sides.
    """

    features_u8: np.ndarray
    colors_u8: np.ndarray
    positions: np.ndarray
    texcoords: np.ndarray
    triangles: np.ndarray

    def __post_init__(self) -> None:
        features, triangles = self.features_u8, self.triangles
        _require(features.dtype == np.uint8, "page features", "must be uint8", str(features.dtype))
        size_ok = features.ndim == 3 and features.shape[2] == FEATURE_CHANNELS
        _require(size_ok, "page features", "must be [height, width, 8]", str(features.shape))
        powers = all(1 <= n <= MAX_PAGE_SIZE_PX and n & (n - 1) == 0 for n in features.shape[:2])
        _require(powers, "page size", f"must be powers of two up to {MAX_PAGE_SIZE_PX}", str(features.shape[:2]))
        colors_ok = self.colors_u8.dtype == np.uint8 and self.colors_u8.shape == (*features.shape[:2], 3)
        _require(colors_ok, "page colours", "must be uint8 [height, width, 3]", str(self.colors_u8.shape))
        count = len(self.positions)
        _require(self.positions.shape == (count, 3), "positions", "must be [V, 3]", str(self.positions.shape))
        _require(self.texcoords.shape == (count, 2), "texcoords", "must be [V, 2]", str(self.texcoords.shape))
        _require(bool(np.isfinite(self.positions).all()), "positions", "must be finite", "NaN or infinity")
        inside = bool(((self.texcoords >= 0) & (self.texcoords <= 1)).all())
        _require(inside, "texcoords", "must lie within [0, 1]", "values outside")
        shape_ok = triangles.ndim == 2 and triangles.shape[1] == 3 and len(triangles) > 0
        _require(shape_ok, "triangles", "must be [T, 3] with at least one triangle", str(triangles.shape))
        in_range = int(triangles.max()) < count
        _require(in_range, "triangles", f"must index the {count} vertices", f"index {int(triangles.max())}")


@dataclass(frozen=True)
class BakedScene:
    """Everything that is shipped of a scene.

    Attributes:
        pages: at least one.
        network: the shader network.
        background: sRGB in [0, 1] that the photos were shown over.
        asset_from_object: [4, 4] float64 similarity: the object frame in the asset's, glTF's (+y up).
        cameras: views worth offering to a person, in the object frame.
        user_from_object: [4, 4] float64 similarity: the object frame in that of the capture's files.
        start_camera: index among `cameras` of the one to start from; None leaves it to the viewer. Scenes that surround
            their cameras have one: from outside there is nothing to see.
    """

    pages: tuple[Page, ...]
    network: ShaderNetwork
    background: tuple[float, float, float]
    asset_from_object: np.ndarray
    cameras: tuple[Camera, ...] = ()
    user_from_object: np.ndarray = field(default_factory=lambda: np.eye(4))
    start_camera: int | None = None

    def __post_init__(self) -> None:
        _require(len(self.pages) > 0, "scene", "must have at least one page", "none")
        check_similarity("asset_from_object", self.asset_from_object)
        check_similarity("user_from_object", self.user_from_object)
        start = self.start_camera
        among = start is None or (type(start) is int and 0 <= start < len(self.cameras))
        _require(among, "start_camera", f"must be one of the {len(self.cameras)} cameras", str(start)[:20])
        background_ok = len(self.background) == 3 and all(0 <= c <= 1 for c in self.background)
        _require(background_ok, "background", "must be three numbers in [0, 1]", str(self.background))

    @property
    def triangle_count(self) -> int:
        return sum(len(page.triangles) for page in self.pages)

    @property
    def quad_count(self) -> int:
        """Quads, each stored as two triangles."""
        return self.triangle_count // 2

    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """(lowest, highest) corner [3] float64 of all vertices, object frame."""
        points = np.concatenate([page.positions for page in self.pages]).astype(np.float64)
        return points.min(0), points.max(0)


def similarity_scale(matrix: np.ndarray) -> float:
    """The uniform scale, > 0, of a similarity [4, 4]; exact where its rotation permutes axes."""
    with np.errstate(over="ignore"):
        return float(np.median(np.linalg.norm(np.asarray(matrix, np.float64)[:3, :3], axis=0)))


def check_similarity(subject: str, matrix: np.ndarray) -> None:
    """Raises SceneInvalid unless `matrix` is a finite [4, 4] rotation, translation and one positive scale."""
    ok = np.shape(matrix) == (4, 4) and bool(np.isfinite(matrix).all())
    _require(ok, subject, "must be a finite 4x4 matrix", str(np.shape(matrix)))
    scale = similarity_scale(matrix)
    ok = SMALLEST_SCALE <= scale <= 1 / SMALLEST_SCALE and np.array_equal(np.asarray(matrix)[3], [0, 0, 0, 1])
    if ok:
        block = np.asarray(matrix, np.float64)[:3, :3] / scale
        with np.errstate(over="ignore", invalid="ignore"):
            orthogonal = np.allclose(block.T @ block, np.eye(3), atol=SIMILARITY_TOLERANCE)
        ok = orthogonal and bool(np.linalg.det(block) > 0)
    rule = f"must be a rotation, a translation and one scale, {SMALLEST_SCALE:g} to {1 / SMALLEST_SCALE:g}"
    _require(ok, subject, rule, str(np.asarray(matrix).tolist()))


def _sigmoid(x: np.ndarray) -> np.ndarray:
    # tanh saturates without overflow at either end.
    return 0.5 * (1.0 + np.tanh(0.5 * x))


def _require(holds: bool, subject: str, rule: str, received: str) -> None:
    if not holds:
        raise SceneInvalid(subject, rule, received)
