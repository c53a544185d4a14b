"""Binary PLY: one mesh with colours at its vertices; holes are cut out of it."""

import numpy as np

from core.baked import BakedScene
from core.errors import SceneInvalid
from exporters.plain.placed import placed
from exporters.plain.subdivision import pieces_of, texels_of_a_side

FILE_NAME = "scene.ply"
MOST_TRIANGLES = 1_000_000  # 20 MB
MOST_SIDES = 8
SAME_PLACE = 2.0**-20  # of the scene's extent
_HEADER = """ply
format binary_little_endian 1.0
comment +y up; colours are sRGB
element vertex {vertices}
property float x
property float y
property float z
property uchar red
property uchar green
property uchar blue
element face {faces}
property list uchar int vertex_indices
end_header
"""
_VERTEX = np.dtype([("position", "<f4", 3), ("color", "u1", 3)])
_FACE = np.dtype([("count", "u1"), ("corners", "<i4", 3)])


def write_ply(scene: BakedScene, most_triangles: int = MOST_TRIANGLES) -> dict[str, bytes]:
    """`{"scene.ply": ...}`: triangles small enough that a colour at each corner says what the texture did.

    Every triangle is divided evenly, as finely as `most_triangles` allows (at most 8 times a side, and not finer than
    the texels of most sides; never joined).
    Pieces that are mostly hole are left out, and corners at one place are one vertex with their mean colour.

    Raises:
        SceneInvalid: nothing is opaque.
    """
    most_sides = int(np.clip(np.sqrt(most_triangles / scene.triangle_count), 1, MOST_SIDES))
    parts = [
        part
        for page in scene.pages
        for part in pieces_of(page, placed(scene, page), min(most_sides, texels_of_a_side(page)))
    ]
    corners = np.concatenate([part.corners for part in parts]).reshape(-1, 3)
    colors = np.repeat(np.concatenate([part.colors for part in parts]), 3, 0)
    if not len(corners):
        raise SceneInvalid("scene", "must have an opaque texel", "holes only")
    first, number = _places(corners)
    faces = number.reshape(-1, 3)
    faces = faces[(faces != np.roll(faces, 1, 1)).all(1)]
    if not len(faces):
        raise SceneInvalid("scene", "must have triangles with an area", "points and lines")
    return {FILE_NAME: _file(corners[first], _means(colors, number), faces)}


def _places(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(the first point at each place, the place of each point [n]) of points [n, 3]."""
    low, high = points.min(0), points.max(0)
    extent = float((high - low).max())
    steps = np.rint((points - low) / (extent * SAME_PLACE if extent > 0 else 1.0)).astype(np.int64)
    _, first, number = np.unique(steps @ [1, 1 << 21, 1 << 42], return_index=True, return_inverse=True)
    return first, number


def _means(values: np.ndarray, number: np.ndarray) -> np.ndarray:
    """[groups, 3]: the mean of values [n, 3] of each group."""
    count = np.bincount(number)
    return np.stack([np.bincount(number, channel) / count for channel in values.T], -1)


def _file(positions: np.ndarray, colors: np.ndarray, faces: np.ndarray) -> bytes:
    vertices = np.empty(len(positions), _VERTEX)
    vertices["position"], vertices["color"] = positions, np.rint(colors)
    rows = np.empty(len(faces), _FACE)
    rows["count"], rows["corners"] = 3, faces
    header = _HEADER.format(vertices=len(vertices), faces=len(rows)).encode()
    return b"".join([header, vertices.tobytes(), rows.tobytes()])
