"""The paper's quads on a surface: one closed layer, on it."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from core.mesh.quad_mesh import VERTEX_REACH
from core.mesh.surface import BISECTIONS, pulled_to_surface, surface_of

P = 16
CELL = 2.0 / P


def ball(radius: float, centre=(0.0, 0.0, 0.0)):
    return lambda points: np.linalg.norm(points - np.array(centre), axis=-1) - radius


def at_corners(distance) -> np.ndarray:
    axis = np.arange(P + 1) * CELL - 1.0
    return distance(np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), -1).reshape(-1, 3)).reshape((P + 1,) * 3)


def edges_of(quads: np.ndarray) -> np.ndarray:
    """[n, 2], the sides of quads with corners 00, 01, 10, 11, smaller cell first."""
    sides = np.concatenate([quads[:, pair] for pair in ([0, 1], [1, 3], [3, 2], [2, 0])])
    return np.sort(sides, 1)


@settings(max_examples=30, deadline=None)
@given(st.floats(0.15, 0.7), st.tuples(*[st.floats(-0.15, 0.15)] * 3))
def test_a_balls_surface_is_one_closed_layer_on_it(radius, centre):
    distance = ball(radius, centre)
    quads, places = surface_of(at_corners(distance), distance)
    _, times = np.unique(edges_of(quads), axis=0, return_counts=True)
    assert (times % 2 == 0).all()  # closed; four quads meet where the surface touches itself
    used = places[np.unique(quads)]
    # The mean of points on a sphere lies inside it by at most its sagitta over a cell's diagonal.
    sagitta = radius - np.sqrt(max(radius**2 - 0.75 * CELL**2, 0.0))
    assert np.abs(distance(used)).max() <= sagitta + CELL / 2**BISECTIONS


@settings(max_examples=30, deadline=None)
@given(st.tuples(*[st.floats(-1.0, 1.0)] * 3).filter(lambda n: np.linalg.norm(n) > 0.1), st.floats(-0.4, 0.4))
def test_vertices_of_a_plane_lie_on_it_in_any_direction(normal, offset):
    n = np.array(normal) / np.linalg.norm(normal)

    def distance(points):
        return points @ n - offset

    quads, places = surface_of(at_corners(distance), distance)
    assert np.abs(distance(places[np.unique(quads)])).max(initial=0.0) <= CELL / 2**BISECTIONS


def test_a_function_that_only_tells_inside_from_outside_will_do():
    smooth = ball(0.5)

    def step(points):
        return np.where(smooth(points) < 0, -1.0, 1.0)

    expected, found = surface_of(at_corners(smooth), smooth), surface_of(at_corners(step), step)
    np.testing.assert_array_equal(found[0], expected[0])
    np.testing.assert_array_equal(found[1], expected[1])


@pytest.mark.parametrize("value", [-1.0, 1.0])
def test_all_inside_and_all_outside_have_no_surface(value):
    quads, places = surface_of(np.full((P + 1,) * 3, value), lambda points: np.full(len(points), value))
    assert len(quads) == 0
    assert np.isnan(places).all()


def test_quads_stop_at_the_grids_rim():
    distance = ball(1.5)  # leaves the cube on every side
    corners = np.where(np.arange(P + 1) > P // 2, -1.0, 1.0)[:, None, None] * np.ones((P + 1,) * 3)
    quads, _ = surface_of(corners, lambda points: 0.06 - points[:, 0])
    assert len(quads) == (P - 1) ** 2
    assert (quads >= 0).all()
    assert surface_of(at_corners(distance), distance)[0].min(initial=0) >= 0


@pytest.mark.parametrize("shift", [-0.4, 0.0, 0.3])
def test_places_are_pulled_to_the_surface_within_their_cells(rng, shift):
    distance = ball(0.6)

    def in_cells(points):
        return np.clip(distance(points) / CELL, -1.0, 1.0)

    quads, places = surface_of(at_corners(distance), distance)
    cells = np.unique(quads)
    centre = (np.stack(np.unravel_index(cells, (P,) * 3), -1) + 0.5) * CELL - 1.0
    start = places[cells] * (1.0 + shift * CELL)
    start[::7] = np.nan  # unknown ones start from the centre
    pulled = pulled_to_surface(start, cells, P, in_cells, 1.0, VERTEX_REACH, rounds=4)
    assert (np.abs(pulled - centre) <= VERTEX_REACH * CELL + 1e-12).all()
    free = (np.abs(pulled - centre) < (VERTEX_REACH - 1e-9) * CELL).all(1)
    assert free.mean() > 0.7
    assert np.abs(in_cells(pulled[free])).max() < 0.02


def test_where_nothing_is_known_places_stay():
    cells = np.array([(3 * P + 4) * P + 5])
    start = (np.array([[3.2, 4.4, 5.6]]) + 0.0) * CELL - 1.0
    stays = pulled_to_surface(start, cells, P, lambda points: np.full(len(points), 0.7), 1.0, VERTEX_REACH)
    np.testing.assert_allclose(stays, start, atol=1e-15)
