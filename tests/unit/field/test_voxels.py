"""The voxel field: occupancy, the nodes that train, and finer grids."""

import numpy as np
import pytest
import torch

from core.field.bricks import from_bricks, places_in, to_bricks
from core.field.parameters import Parameters
from core.field.space import Space
from core.field.voxels import EMPTY_DENSITY, VoxelField, _active_nodes
from core.oracles.grid import trilinear
from core.presets import PRESETS
from core.training.voxel_stage import levels_of

EVERYTHING = np.ones((64, 64, 64), bool)


def nodes_read(occupied: np.ndarray, nodes: int) -> np.ndarray:
    """[nodes^3] bool: corners of the grid's cubes that overlap an occupied cell."""
    cells = len(occupied)
    read = np.zeros((nodes,) * 3, bool)
    for cell in np.argwhere(occupied):
        low = np.floor(cell / cells * (nodes - 1) + 1e-9).astype(int)
        high = np.minimum(np.ceil((cell + 1) / cells * (nodes - 1) - 1e-9).astype(int), nodes - 1)
        read[tuple(slice(a, b + 1) for a, b in zip(low, high, strict=True))] = True
    return read.reshape(-1)


def grids() -> list[tuple[int, int]]:
    """(nodes, occupancy cells) of all levels of all presets, and odd ones."""
    of_presets = {
        (level.nodes, cells)
        for preset in PRESETS.values()
        for level in levels_of(preset)
        for cells in (64, level.occupancy_cells)
    }
    return sorted(of_presets | {(16, 64), (17, 64), (64, 64), (63, 64), (96, 96), (40, 85)})


@pytest.mark.parametrize(("nodes", "cells"), grids())
def test_exactly_the_nodes_that_samples_in_occupied_cells_read_train(rng, nodes, cells):
    occupied = np.zeros((cells,) * 3, bool)
    occupied[tuple(rng.integers(0, cells, (3, 30)))] = True  # single cells: the thinnest parts
    occupied[[0, -1, 0, -1], [0, -1, -1, 0], [0, -1, 0, -1]] = True
    active = torch.zeros(places_in(nodes), dtype=torch.bool)
    active[_active_nodes(torch.from_numpy(occupied), nodes).long()] = True
    np.testing.assert_array_equal(from_bricks(active, nodes).reshape(-1).numpy(), nodes_read(occupied, nodes))


def field_with(density: np.ndarray, occupied=EVERYTHING) -> VoxelField:
    field = VoxelField.new(Space.cube(), len(density), occupied, 0, "cpu")
    field.parameters.scalar.copy_(to_bricks(torch.from_numpy(density.astype(np.float32))))
    return field


def test_a_finer_grid_holds_the_same_field(rng):
    field = field_with(rng.normal(0, 0.2, (9, 9, 9)))
    finer = field.upsampled(23)
    points = torch.from_numpy(rng.uniform(-1, 1, (500, 3)))
    at_nodes = torch.from_numpy(np.linspace(-1, 1, 23)[rng.integers(0, 23, (500, 3))])
    old, new = (from_bricks(f.parameters.scalar.double(), f.nodes)[..., None] for f in (field, finer))
    torch.testing.assert_close(trilinear(new, at_nodes), trilinear(old, at_nodes), atol=1e-6, rtol=0)  # float32
    assert float((trilinear(new, points) - trilinear(old, points)).abs().max()) < 0.4  # bends lie between its nodes
    assert finer.step < field.step
    assert not any(moment.any() for moment in finer.parameters.moments)


def test_empty_space_is_left_out_and_matter_stays():
    density = np.full((48, 48, 48), EMPTY_DENSITY)
    density[20:28, 20:28, 20:28] = 1.0
    field = field_with(density)
    field.update_occupancy(64, EVERYTHING)
    ticks = (np.arange(64) + 0.5) / 64 * 2 - 1
    inside = (np.abs(ticks - (23.5 / 47 * 2 - 1)) < 3.5 / 47 * 2).nonzero()[0]
    assert bool(field.occupied[np.ix_(inside, inside, inside)].all())
    assert float(field.occupied.float().mean()) < 0.05


def test_a_single_noisy_node_does_not_count_as_matter():
    density = np.full((48, 48, 48), EMPTY_DENSITY)
    density[24, 24, 24] = 30.0
    field = field_with(density)
    field.update_occupancy(64, EVERYTHING)
    assert not field.occupied.any()
    assert float(field.parameters.scalar.max()) == EMPTY_DENSITY


@pytest.mark.parametrize("cells", [64, 85, 96])
def test_nothing_outside_the_hull_is_occupied_and_nothing_inside_is_lost(rng, cells):
    hull = np.zeros((64, 64, 64), bool)
    hull[tuple(rng.integers(2, 62, (3, 40)))] = True
    field = field_with(np.ones((48, 48, 48)), hull)
    field.update_occupancy(cells, hull)
    assert field.occupied.shape == (cells,) * 3
    points = rng.uniform(-1, 1, (200_000, 3))
    in_hull = hull[tuple(np.floor((points + 1) * 32).astype(int).T)]
    occupied = field.occupied.numpy()[tuple(np.floor((points + 1) * cells / 2).astype(int).T)]
    assert occupied[in_hull].all()
    spread = 1.0 if cells == 64 else (64 / cells + 1) ** 3  # a finer cell may overlap several of the hull's
    assert occupied.mean() <= spread * hull.mean() * 1.05


def test_a_new_field_depends_on_its_seed_alone():
    one, same, other = (
        VoxelField.new(Space.cube(), 8, EVERYTHING, seed, "cpu").parameters.features for seed in (1, 1, 2)
    )
    assert torch.equal(one, same)
    assert not torch.equal(one, other)


def test_no_ray_in_the_cube_needs_more_samples_than_stated():
    field = VoxelField.new(Space.cube(), 20, EVERYTHING, 0, "cpu")
    assert (field.max_samples() - 1) * field.step > 2 * np.sqrt(3)


def test_rows_put_back_what_they_kept(rng):
    parameters = Parameters.starting_from(torch.rand(20), torch.rand(20, 8))
    for moment in parameters.moments:
        moment.copy_(torch.rand_like(moment))
    index = torch.tensor([3, 7, 19])
    some = parameters.training(index.int())
    fresh = Parameters.starting_from(torch.zeros(20), torch.zeros(20, 8), index.int())
    fresh.restore_rows(some.rows())
    for original, restored in [(parameters.scalar, fresh.scalar), (parameters.features, fresh.features)]:
        assert torch.equal(restored[index], original[index])
        assert restored.count_nonzero() == original[index].count_nonzero()
    for original, restored in zip(parameters.moments, fresh.moments, strict=True):
        assert torch.equal(restored, original[index])


def test_entries_that_go_on_training_keep_their_moments():
    parameters = Parameters.starting_from(torch.rand(20), torch.rand(20, 8), torch.tensor([2, 5, 9, 14]).int())
    for moment in parameters.moments:
        moment.copy_(torch.rand_like(moment))
    others = parameters.training(torch.tensor([1, 5, 14, 15]).int())
    for before, after in zip(parameters.moments, others.moments, strict=True):
        assert torch.equal(after[[1, 2]], before[[1, 3]])
        assert not after[[0, 3]].any()
    assert others.row_of[[1, 5, 14, 15]].tolist() == [0, 1, 2, 3]
    assert int((others.row_of >= 0).sum()) == 4
