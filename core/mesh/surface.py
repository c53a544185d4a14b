"""The paper's quads on a surface: one for each grid edge that crosses it (dual contouring, Ju et al. 2002).

The paper has one vertex per cell and one quad per grid edge (3.1). Of these quads, those whose edge leads from inside
to outside make one coherent layer, whose vertices lie where the edges cross the surface.

What is inside is told by a function of points: `distance(points [n, 3] of the cells' cube) -> [n]`, negative inside.
"""

from collections.abc import Callable

import numpy as np

BISECTIONS = 6  # of an edge: a place to 1/64 of a cell
Distance = Callable[[np.ndarray], np.ndarray]


def surface_of(corners: np.ndarray, distance: Distance) -> tuple[np.ndarray, np.ndarray]:
    """The quads across a surface, and where it crosses cells.

    Args:
        corners: [P + 1, P + 1, P + 1], the function at the cells' corners.
        distance: the function, of points [n, 3] of the cells' cube [-1, 1]^3.

    Returns:
        (quads [n, 4] int64, flat indices of the cells around each edge, as corners 00, 01, 10, 11;
        places [P^3, 3], mean of the crossings of each cell's edges in the cells' cube, NaN where there are none)
    """
    P = corners.shape[0] - 1
    total, count, quads = np.zeros((P**3, 3)), np.zeros(P**3), []
    for axis in range(3):
        low = _crossed_edges(corners, axis)
        crossing = _crossings(corners, low, axis, distance)
        around = _cells_around(low, axis, P)
        for cell in around.T:
            there = cell >= 0
            np.add.at(total, cell[there], crossing[there])
            np.add.at(count, cell[there], 1)
        quads.append(around[(around >= 0).all(1)])
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.concatenate(quads), total / count[:, None]


def pulled_to_surface(
    places: np.ndarray, cells: np.ndarray, P: int, distance: Distance, band: float, reach: float, rounds: int = 2
) -> np.ndarray:
    """Places [n, 3] moved to where a distance is 0 by Newton's steps along its slope, each within its cell.

    Args:
        cells: [n], flat index of each place's cell.
        distance: as in `surface_of`; its values times `band` (in cells) are distances near the surface.
        reach: from the cell's centre at most, in cells.
    """
    size = 2.0 / P
    centre = (np.stack(np.unravel_index(cells, (P,) * 3), -1) + 0.5) * size - 1.0
    p = np.where(np.isfinite(places), places, centre)
    for _ in range(rounds):
        slope = np.stack([_slope(distance, p, axis, size) for axis in range(3)], -1) * band
        steep = (slope**2).sum(1)
        # Where pictures disagree the mean is flat, and a step would lead anywhere.
        step = np.where(steep > LEAST_SLOPE**2, -distance(p) * band / np.maximum(steep, LEAST_SLOPE), 0.0)
        moved = np.clip(step[:, None] * slope, -LONGEST_STEP, LONGEST_STEP) * size
        p = np.clip(p + moved, centre - reach * size, centre + reach * size)
    return p


LEAST_SLOPE = 0.2  # of a true distance it is 1
LONGEST_STEP = 0.3  # cells
SLOPE_REACH = 0.25  # cells, to either side


def _slope(distance: Distance, p: np.ndarray, axis: int, size: float) -> np.ndarray:
    """[n], per cell."""
    away = np.zeros(3)
    away[axis] = SLOPE_REACH * size
    return (distance(p + away) - distance(p - away)) / (2.0 * SLOPE_REACH)


def _crossed_edges(corners: np.ndarray, axis: int) -> np.ndarray:
    """[n, 3], the lower corner of each edge along an axis that leads from inside to outside or back."""
    inside = np.moveaxis(corners < 0, axis, 0)
    return np.stack(np.nonzero(np.moveaxis(inside[:-1] != inside[1:], 0, axis)), -1)


def _crossings(corners: np.ndarray, low: np.ndarray, axis: int, distance: Distance) -> np.ndarray:
    """[n, 3], where edges cross the surface, in the cells' cube, by bisection: the function need not be smooth."""
    P = corners.shape[0] - 1
    begins_inside = corners[tuple(low.T)] < 0
    near, far = np.zeros(len(low)), np.ones(len(low))
    for _ in range(BISECTIONS):
        middle = (near + far) / 2.0
        same = (distance(_along(low, axis, middle, P)) < 0) == begins_inside
        near, far = np.where(same, middle, near), np.where(same, far, middle)
    return _along(low, axis, (near + far) / 2.0, P)


def _along(low: np.ndarray, axis: int, share: np.ndarray, P: int) -> np.ndarray:
    place = low.astype(np.float64)
    place[:, axis] += share
    return place * (2.0 / P) - 1.0


def _cells_around(low: np.ndarray, axis: int, P: int) -> np.ndarray:
    """[n, 4], flat indices of the cells around edges, in the order 00, 01, 10, 11; -1 beyond the grid."""
    first, second = (other for other in range(3) if other != axis)
    cells = []
    for a in (-1, 0):
        for b in (-1, 0):
            cell = low.copy()
            cell[:, first] += a
            cell[:, second] += b
            inside = ((cell >= 0) & (cell < P)).all(1)
            cells.append(np.where(inside, (cell[:, 0] * P + cell[:, 1]) * P + cell[:, 2], -1))
    return np.stack(cells, -1)
