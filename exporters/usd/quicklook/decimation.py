"""Fewer triangles of nearly the same surface.

Quads of a MobileNeRF are no manifold: in lego_400 half of the edges have three or four of them. Quadric edge collapse
(Garland and Heckbert, as in fast-simplification) copes, but keeps borders, and may stop early; then vertices are
clustered.
"""

import fast_simplification
import numpy as np

AGGRESSION = 5.0  # fast-simplification's middle way between speed and precision
CELL_GROWTH = 1.25


def decimated(positions: np.ndarray, triangles: np.ndarray, most: int) -> tuple[np.ndarray, np.ndarray]:
    """Vertices float32 [V, 3] and triangles int64 [T, 3], T <= `most`, of a surface; the surface itself if it has few.

    Vertices at one place are one; triangles without area are gone. Orientation means nothing.
    """
    positions, triangles = _welded(positions, triangles)
    if len(triangles) > most:
        found = fast_simplification.simplify(positions, triangles.astype(np.int32), target_count=most, agg=AGGRESSION)
        positions, triangles = _welded(*found)
    cell = _median_edge(positions, triangles) / 2 if len(triangles) > most else 0.0
    while len(triangles) > most:
        positions, triangles = clustered(positions, triangles, cell)
        cell *= CELL_GROWTH
    return positions, triangles


def clustered(positions: np.ndarray, triangles: np.ndarray, cell: float) -> tuple[np.ndarray, np.ndarray]:
    """All vertices in a cube of side `cell` become their mean (Rossignac and Borrel)."""
    cubes = np.floor((positions - positions.min(0)) / cell).astype(np.int64)
    _, cluster, count = np.unique(cubes, axis=0, return_inverse=True, return_counts=True)
    means = np.zeros((len(count), 3))
    np.add.at(means, cluster.ravel(), positions)
    means /= count[:, None]
    return _welded(means.astype(np.float32), cluster.ravel()[triangles])


def _welded(positions: np.ndarray, triangles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """One vertex a place, no triangle without three places, no two of the same three; only vertices in use."""
    _, first, place = np.unique(positions, axis=0, return_index=True, return_inverse=True)
    triangles = place.ravel()[np.asarray(triangles, np.int64)]
    a, b, c = triangles.T
    triangles = triangles[(a != b) & (b != c) & (c != a)]
    _, kept = np.unique(np.sort(triangles, axis=1), axis=0, return_index=True)
    triangles = triangles[np.sort(kept)]
    used, triangles = np.unique(triangles, return_inverse=True)
    return np.asarray(positions, np.float32)[first[used]], triangles.reshape(-1, 3)


def _median_edge(positions: np.ndarray, triangles: np.ndarray) -> float:
    corners = positions[triangles]
    return float(np.median(np.linalg.norm(corners - np.roll(corners, 1, 1), axis=-1)))
