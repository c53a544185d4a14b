"""A node's place: similarities as translation, rotation and scale, in double precision.

Nodes are written as TRS, not as matrices: Khronos' validator takes a matrix apart in float32 and refuses one of a large
scale, and viewers animate TRS only.
"""

from typing import Any

import numpy as np

from core.baked import similarity_scale
from exporters.invalid import invalid
from exporters.numbers import matrix_from_column_major, numbers

SAME_SCALE = 1e-6  # relative difference of a node's three scales that counts as rounding


def trs(matrix: np.ndarray) -> dict[str, list[float]]:
    """`translation`, `rotation` (unit quaternion x, y, z, w) and `scale` of a similarity [4, 4]; defaults left out.

    `node_matrix` returns the matrix: exactly where the rotation permutes axes, else within some 1e-15 of the scale.
    """
    block = np.asarray(matrix[:3, :3], np.float64)
    scale = similarity_scale(matrix)
    found: dict[str, list[float]] = {
        "translation": matrix[:3, 3].tolist(),
        "rotation": _quaternion(block / scale).tolist(),
        "scale": [scale] * 3,
    }
    defaults = {"translation": [0.0] * 3, "rotation": [0.0, 0.0, 0.0, 1.0], "scale": [1.0] * 3}
    return {name: value for name, value in found.items() if value != defaults[name]}


def node_matrix(node: dict[str, Any], subject: str) -> np.ndarray:
    """[4, 4] float64 of a node's JSON, written as `matrix` or as TRS with one scale; the identity where it has neither.

    Raises:
        AssetInvalid: not numbers, or scales that differ. ValueError: not as many as there must be.
    """
    if "matrix" in node:
        return matrix_from_column_major(node["matrix"], subject)
    translation, rotation, scales = (
        numbers(node.get(name, default), f"{subject}'s {name}").reshape(len(default))
        for name, default in (("translation", [0.0] * 3), ("rotation", [0.0, 0.0, 0.0, 1.0]), ("scale", [1.0] * 3))
    )
    scale = float(np.median(scales))
    if not np.abs(scales - scale).max() <= SAME_SCALE * abs(scale):
        raise invalid(subject, "must have one scale", str(scales.tolist())[:80])
    matrix = np.eye(4)
    matrix[:3, :3] = scale * _rotation(rotation)
    matrix[:3, 3] = translation
    return matrix


def nearest_rotation(block: np.ndarray) -> np.ndarray:
    """[3, 3] rotation nearest to a block (polar decomposition): glTF wants it closer than poses come."""
    u, _, vt = np.linalg.svd(block)
    rotation: np.ndarray = u @ vt
    return rotation


def _quaternion(r: np.ndarray) -> np.ndarray:
    """(x, y, z, w) of a rotation [3, 3], w >= 0. The largest of the four is computed first (Shepperd's method)."""
    candidates = np.array(
        [
            [1 + r[0, 0] - r[1, 1] - r[2, 2], r[0, 1] + r[1, 0], r[0, 2] + r[2, 0], r[2, 1] - r[1, 2]],
            [r[0, 1] + r[1, 0], 1 - r[0, 0] + r[1, 1] - r[2, 2], r[1, 2] + r[2, 1], r[0, 2] - r[2, 0]],
            [r[0, 2] + r[2, 0], r[1, 2] + r[2, 1], 1 - r[0, 0] - r[1, 1] + r[2, 2], r[1, 0] - r[0, 1]],
            [r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1], 1 + r[0, 0] + r[1, 1] + r[2, 2]],
        ]
    )
    q = candidates[np.argmax(np.diag(candidates))]
    q = q / np.linalg.norm(q)
    return (-q if q[3] < 0 else q) + 0.0  # + 0.0: no negative zeros


def _rotation(q: np.ndarray) -> np.ndarray:
    """[3, 3] of a quaternion (x, y, z, w) of about unit length; divided by its square, so that halves cancel."""
    x, y, z, w = q
    square = q @ q
    twice = 2.0 * np.array(
        [
            [-(y * y + z * z), x * y - z * w, x * z + y * w],
            [x * y + z * w, -(x * x + z * z), y * z - x * w],
            [x * z - y * w, y * z + x * w, -(x * x + y * y)],
        ]
    )
    with np.errstate(divide="ignore", invalid="ignore"):  # a zero quaternion gives NaN, which the scene refuses
        rotation: np.ndarray = np.eye(3) + twice / square + 0.0
    return rotation
