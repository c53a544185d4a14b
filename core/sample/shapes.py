"""The three ways the sample's parts are shaped: turned on a lathe, swept along a path, and leaves."""

from __future__ import annotations

import itertools

import numpy as np
import numpy.typing as npt

from core.sample.mesh import Mesh, grid_mesh


def smooth_curve(points: npt.ArrayLike, count: int) -> np.ndarray:
    """[count, d] points of the Catmull-Rom curve through `points` [n, d]."""
    knots = np.asarray(points, np.float64)
    padded = np.concatenate([[2 * knots[0] - knots[1]], knots, [2 * knots[-1] - knots[-2]]])
    at = np.linspace(0, len(knots) - 1, count)
    span = np.minimum(at.astype(int), len(knots) - 2)
    t = (at - span)[:, None]
    a, b, c, d = (padded[span + offset] for offset in range(4))
    return 0.5 * (2 * b + (c - a) * t + (2 * a - 5 * b + 4 * c - d) * t**2 + (3 * b - a - 3 * c + d) * t**3)


def resampled(points: npt.ArrayLike, step: float) -> np.ndarray:
    """Points about `step` apart on the polyline through `points` [n, d], corners kept."""
    corners = np.asarray(points, np.float64)
    pieces = [
        np.linspace(a, b, max(1, round(float(np.linalg.norm(b - a)) / step)), endpoint=False)
        for a, b in itertools.pairwise(corners)
    ]
    return np.concatenate([*pieces, corners[-1:]])


def lathe(profile: np.ndarray, material: int, columns: int = 96) -> Mesh:
    """A profile [n, 2] of (radius, z), turned about the z axis; going up, the outside is to the right.

    uv: (angle in turns, z).
    """
    angle = np.linspace(0, 2 * np.pi, columns + 1)
    tangent = _tangents(profile)
    radius, z = profile[:, 0, None], profile[:, 1, None]
    across, up = tangent[:, 1, None], -tangent[:, 0, None]
    cos, sin = np.cos(angle), np.sin(angle)
    positions = np.stack([radius * cos, radius * sin, np.broadcast_to(z, (len(z), columns + 1))], -1)
    normals = np.stack([across * cos, across * sin, np.broadcast_to(up, (len(z), columns + 1))], -1)
    uv = np.stack(np.broadcast_arrays(angle / (2 * np.pi), z), -1)
    return grid_mesh(positions, normals, uv, material)


def tube(path: np.ndarray, radii: np.ndarray | float, material: int, sides: int = 12) -> Mesh:
    """A round tube along a path [n, 3] with radii [n]; open where the end radius is not 0.

    The cross-section is carried along without twisting (parallel transport). uv: (angle in turns, length).
    """
    radii = np.broadcast_to(np.asarray(radii, np.float64), len(path))
    tangent = _tangents(path)
    side = np.cross(tangent[0], [0.0, 0.0, 1.0] if abs(tangent[0, 2]) < 0.9 else [1.0, 0.0, 0.0])
    sides_along = []
    for direction in tangent:
        side = side - direction * (side @ direction)
        side = side / np.linalg.norm(side)
        sides_along.append(side)
    u = np.array(sides_along)[:, None]
    v = np.cross(tangent, u[:, 0])[:, None]
    angle = np.linspace(0, 2 * np.pi, sides + 1)[:, None]
    outward = np.cos(angle) * u + np.sin(angle) * v
    length = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(path, axis=0), axis=1))])
    slope = np.gradient(radii, np.maximum(length, np.arange(len(length)) * 1e-9))
    normals = outward - slope[:, None, None] * tangent[:, None]
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    uv = np.stack(np.broadcast_arrays(angle[:, 0] / (2 * np.pi), length[:, None]), -1)
    return grid_mesh(path[:, None] + radii[:, None, None] * outward, normals, uv, material)


def leaf(length: float, width: float, bend: float, material: int, notch: float = 0.0, widest: float = 0.5) -> Mesh:
    """A curled leaf or petal from the origin along +x, facing +z, its tip `bend` radians down.

    Args:
        notch: how deep the tip is cut in, as a share of the length (cherry petals).
        widest: where it is widest, as a share of the length.

    uv: (-1..1 across, 0..1 along).
    """
    along, across = np.linspace(0, 1, 10)[:, None], np.linspace(-1, 1, 7)[None]
    half = 0.5 * width * np.sin(np.pi * along ** (np.log(0.5) / np.log(widest))) ** 0.8
    reach = length * along * (1 - notch * (1 - np.abs(across)) * along**4)
    turn = bend * reach / length
    x = length * np.sin(turn) / bend
    z = -length * (1 - np.cos(turn)) / bend + 0.35 * half * across**2
    y = half * across
    positions = np.stack(np.broadcast_arrays(x, y, z), -1)
    normals = np.cross(np.gradient(positions, axis=0), np.gradient(positions, axis=1))
    normals /= np.maximum(np.linalg.norm(normals, axis=-1, keepdims=True), 1e-12)
    normals[np.linalg.norm(normals, axis=-1) < 0.5] = [0.0, 0.0, 1.0]
    return grid_mesh(positions, normals, np.stack(np.broadcast_arrays(across, along), -1), material)


def ball(centre: npt.ArrayLike, radius: float, material: int, columns: int = 10) -> Mesh:
    angle = np.linspace(-np.pi / 2, np.pi / 2, columns // 2 + 2)
    return lathe(radius * np.stack([np.cos(angle), np.sin(angle)], -1), material, columns).moved(centre)


def _tangents(points: np.ndarray) -> np.ndarray:
    """Unit tangents [n, d] of a polyline, by central differences."""
    tangent = np.gradient(points, axis=0)
    return tangent / np.maximum(np.linalg.norm(tangent, axis=1, keepdims=True), 1e-12)
