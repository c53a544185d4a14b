"""Patches shrink where that shows little, and by as much as is said."""

import numpy as np
import pytest

from exporters.compaction.resampling import overlaps, shrunk
from exporters.compaction.resolution import Trade, best_sizes, sides, size_options

STEPS = 4000  # of the oracle's lookups along an axis


def looked_up(patch: np.ndarray) -> np.ndarray:
    """[STEPS, STEPS', ...] lookups all over the unit square, as a renderer makes them."""
    at = (np.arange(STEPS // 40) + 0.5) / (STEPS // 40)
    row = np.floor(at * (patch.shape[0] - 1) + 0.5).astype(int)
    column = np.floor(at * (patch.shape[1] - 1) + 0.5).astype(int)
    return patch[row][:, column]


@pytest.mark.parametrize(("few", "many"), [(1, 7), (2, 7), (3, 7), (4, 9), (5, 5), (6, 17)])
def test_overlaps_are_what_lookups_meet(few: int, many: int) -> None:
    at = (np.arange(STEPS) + 0.5) / STEPS
    met = np.zeros((few, many))
    np.add.at(met, (np.floor(at * (few - 1) + 0.5).astype(int), np.floor(at * (many - 1) + 0.5).astype(int)), 1 / STEPS)
    np.testing.assert_allclose(overlaps(few, many), met, atol=2 / STEPS)


def test_constant_patch_keeps_its_value_at_every_size(rng: np.random.Generator) -> None:
    values = np.broadcast_to(rng.normal(size=8).astype(np.float32), (1, 7, 7, 8))
    opaque = rng.random((1, 7, 7)) < 0.8
    for size in [(1, 1), (2, 2), (3, 5), (7, 7)]:
        small, solid = shrunk(values, opaque, size)
        np.testing.assert_allclose(small[solid], np.broadcast_to(values[0, 0, 0], small[solid].shape), rtol=1e-4)


def test_same_size_is_the_identity(rng: np.random.Generator) -> None:
    values, opaque = rng.normal(size=(3, 5, 7, 8)).astype(np.float32), rng.random((3, 5, 7)) < 0.7
    small, solid = shrunk(values, opaque, (5, 7))
    np.testing.assert_array_equal(solid, opaque)
    np.testing.assert_allclose(small[opaque], values[opaque], rtol=1e-4, atol=1e-5)


def test_errors_are_those_that_lookups_meet(rng: np.random.Generator) -> None:
    y, opaque = rng.normal(size=(4, 6, 6, 8)).astype(np.float32), np.ones((4, 6, 6), bool)
    options = size_options(y, opaque, 1.0, np.inf)
    for size, errors in zip(options.sizes, options.errors, strict=True):
        small, _ = shrunk(y, opaque, tuple(size))
        for patch, reduced, error in zip(y, small, errors, strict=True):
            met = ((looked_up(patch) - looked_up(reduced)) ** 2).sum(-1).mean()
            assert error == pytest.approx(met, rel=0.05, abs=0.02)


def test_flat_patches_shrink_to_nothing_much_and_busy_ones_stay(rng: np.random.Generator) -> None:
    flat, busy = np.full((5, 7, 7, 8), 0.3, np.float32), rng.normal(size=(5, 7, 7, 8)).astype(np.float32)
    y, opaque = np.concatenate([flat, busy]), np.ones((10, 7, 7), bool)
    sizes, errors = size_options(y, opaque, 1.0, np.inf).best(np.ones(10), Trade(1e-6, 20.0))
    np.testing.assert_array_equal(sizes, [[1, 1]] * 5 + [[7, 7]] * 5)
    np.testing.assert_allclose(errors, 0, atol=1e-4)


def test_patch_that_changes_along_one_axis_shrinks_along_the_other(rng: np.random.Generator) -> None:
    y = np.broadcast_to(rng.normal(size=(1, 7, 1, 8)), (1, 7, 7, 8)).astype(np.float32)
    sizes, _ = size_options(y, np.ones((1, 7, 7), bool), 1.0, np.inf).best(np.ones(1), Trade(1e-6, 20.0))
    assert sizes.tolist() == [[7, 1]]


def test_infinite_cost_keeps_every_hole_in_its_place(rng: np.random.Generator) -> None:
    y = np.zeros((20, 7, 7, 8), np.float32)
    opaque = rng.random((20, 7, 7)) < 0.9
    sizes, _ = size_options(y, opaque, 1.0, np.inf).best(np.ones(20), Trade(1.0, 20.0))
    for size, patch, mask in zip(sizes, y, opaque, strict=True):
        _, solid = shrunk(patch[None], mask[None], tuple(size))
        np.testing.assert_array_equal(looked_up(solid[0]), looked_up(mask))


def test_finite_cost_leaves_out_what_is_nearly_all_hole() -> None:
    y, opaque = np.zeros((2, 7, 7, 8), np.float32), np.zeros((2, 7, 7), bool)
    opaque[0, 3, 3] = opaque[1] = True
    sizes, _ = size_options(y, opaque, 1.0, 0.1).best(np.ones(2), Trade(1e-4, 20.0))
    assert sizes.tolist() == [[0, 0], [1, 1]]


def test_heavier_patches_keep_more_texels(rng: np.random.Generator) -> None:
    y = np.repeat(0.05 * rng.normal(size=(1, 7, 7, 8)), 2, 0).astype(np.float32)
    weights = np.array([1e-3, 1e3])
    sizes, _ = size_options(y, np.ones((2, 7, 7), bool), 1.0, np.inf).best(weights, Trade(1e-4, 20.0))
    assert sizes[0].prod() < sizes[1].prod()


@pytest.mark.parametrize(
    ("side", "most", "largest"), [(7, 1.0, 7), (7, 0.5, 4), (17, 0.5, 8), (2, 0.5, 2), (1, 0.5, 1)]
)
def test_sides_rise_to_the_largest_allowed(side: int, most: float, largest: int) -> None:
    choices = sides(side, most)
    assert choices == sorted(set(choices))
    assert choices[-1] == largest


@pytest.mark.parametrize("shape", [(7, 7), (17, 5), (4, 9), (3, 1), (1, 1), (2, 7)])
@pytest.mark.parametrize("most", [1.0, 0.5])
def test_sizes_rise_in_proportion_to_the_largest(shape: tuple[int, int], most: float) -> None:
    options = size_options(np.zeros((1, *shape, 8), np.float32), np.ones((1, *shape), bool), most, np.inf)
    sizes = [tuple(size) for size in options.sizes.tolist()]
    largest = sides(shape[0], most)[-1], sides(shape[1], most)[-1]
    assert sizes[-1] == largest
    assert len(set(sizes)) == len(sizes)
    assert {(1, 1), (largest[0], 1), (1, largest[1])} <= set(sizes)
    for height, width in sizes:
        off = abs(height / largest[0] - width / largest[1])
        assert min(height, width) == 1 or off <= 0.5


def mixed_patches(rng: np.random.Generator, size: tuple[int, int]) -> tuple[np.ndarray, np.ndarray]:
    """Whole and cut, flat and busy ones."""
    busy = rng.choice([0.0, 0.01, 0.1, 1.0], (60, 1, 1, 1))
    y = (rng.normal(size=(60, 1, 1, 8)) + busy * rng.normal(size=(60, *size, 8))).astype(np.float32)
    opaque = np.ones((60, *size), bool)
    opaque[::3, : size[0] // 2] = False
    opaque[1::3] = rng.random((20, *size)) < 0.9
    return y, opaque


@pytest.mark.parametrize("size", [(7, 7), (5, 9), (1, 6), (1, 1)])
@pytest.mark.parametrize(("most", "hole_cost"), [(1.0, np.inf), (1.0, 0.3), (0.5, 0.3), (0.5, np.inf)])
def test_few_channels_rule_out_only_what_all_of_them_would(
    rng: np.random.Generator, size: tuple[int, int], most: float, hole_cost: float
) -> None:
    y, opaque = mixed_patches(rng, size)
    weight, trade = rng.uniform(0.1, 3.0, len(y)), Trade(2e-5, 20.0)
    options = size_options(y, opaque, most, hole_cost)
    found = best_sizes(y, opaque, most, hole_cost, weight, trade)
    np.testing.assert_array_equal(found, options.best(weight, trade)[0])


@pytest.mark.parametrize("size", [(7, 7), (5, 9), (1, 6)])
def test_whole_patches_cost_what_patches_with_holes_would(rng: np.random.Generator, size: tuple[int, int]) -> None:
    y, opaque = mixed_patches(rng, size)
    whole = np.concatenate([opaque[2::3], opaque[:1]])  # the last one has holes, so that all are taken for cut
    y = np.concatenate([y[2::3], y[:1]])
    cut, alone = (size_options(y[:n], whole[:n], 1.0, 0.3) for n in (len(y), len(y) - 1))
    # float32 sums of squares about 1, over some 60 texels
    np.testing.assert_allclose(alone.errors, cut.errors[:, :-1], atol=1e-4, rtol=1e-4)
    np.testing.assert_array_equal(alone.texels, cut.texels[:, :-1])
