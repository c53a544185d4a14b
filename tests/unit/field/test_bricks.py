"""The order of grids in memory: each entry has a place of its own, and Python and kernels agree on it."""

import numpy as np
import pytest
import torch
import warp as wp

from core.field.bricks import BRICK, brick_places, bricks_along, from_bricks, places_in, to_bricks
from core.kernels.launch import launch
from core.kernels.smoothness import node_at
from core.kernels.types import brick_place

SIZES = (1, 3, 4, 5, 8, 13)


def nodes_of(n: int) -> np.ndarray:
    return np.stack(np.indices((n,) * 3), -1).reshape(-1, 3)


@pytest.mark.parametrize("n", SIZES)
def test_there_and_back_is_the_same_grid(rng, n):
    for shape in ((n, n, n), (n, n, n, 8)):
        grid = torch.from_numpy(rng.random(shape, np.float32))
        assert torch.equal(from_bricks(to_bricks(grid), n), grid)


@pytest.mark.parametrize("n", SIZES)
def test_an_entry_is_found_at_its_place(rng, n):
    grid = torch.from_numpy(rng.random((n, n, n), np.float32))
    places = brick_places(nodes_of(n), n)
    assert len(np.unique(places)) == n**3
    assert places.max() < places_in(n)
    assert torch.equal(to_bricks(grid)[torch.from_numpy(places)], grid.reshape(-1))


def test_places_beyond_the_grid_are_false():
    assert int(to_bricks(torch.ones(5, 5, 5, dtype=torch.bool)).sum()) == 125


def test_a_brick_lies_in_one_piece():
    places = brick_places(nodes_of(8), 8).reshape(8, 8, 8)
    for i, j, k in np.ndindex(2, 2, 2):
        brick = places[i * BRICK :, j * BRICK :, k * BRICK :][:BRICK, :BRICK, :BRICK]
        assert brick.max() - brick.min() == BRICK**3 - 1


@wp.kernel
def _placed(
    first: int, ijk: wp.array(dtype=wp.vec3i), bricks: int, place: wp.array(dtype=int), back: wp.array(dtype=wp.vec3i)
):
    i = first + wp.tid()
    place[i] = brick_place(ijk[i][0], ijk[i][1], ijk[i][2], bricks)
    back[i] = node_at(place[i], bricks)


@pytest.mark.parametrize("n", SIZES)
def test_kernels_use_the_same_order(device, n):
    ijk = nodes_of(n).astype(np.int32)
    place, back = wp.zeros(n**3, dtype=int, device=device), wp.zeros(n**3, dtype=wp.vec3i, device=device)
    launch(_placed, n**3, [wp.array(ijk, dtype=wp.vec3i, device=device), bricks_along(n), place, back], device)
    np.testing.assert_array_equal(place.numpy(), brick_places(ijk, n))
    np.testing.assert_array_equal(back.numpy(), ijk)
