import numpy as np
import pytest
import warp as wp

from core.kernels.launch import _ranges, accumulator_parts, launch

wp.set_module_options({"enable_backward": False})


@wp.kernel
def square(first: int, values: wp.array(dtype=float), out: wp.array(dtype=float)):
    i = first + wp.tid()
    out[i] = values[i] * values[i]


@wp.kernel
def add_up(first: int, values: wp.array(dtype=float), total: wp.array(dtype=float)):
    wp.atomic_add(total, 0, values[first + wp.tid()])


@pytest.mark.parametrize("count", [1, 2, 7, 8, 1000])
def test_every_index_runs_exactly_once(count):
    values = np.arange(count, dtype=np.float32)
    out = wp.zeros(count, dtype=float, device="cpu")
    launch(square, count, [wp.array(values, dtype=float, device="cpu"), out], "cpu")
    np.testing.assert_array_equal(out.numpy(), values**2)


def test_nothing_runs_for_no_indices():
    launch(square, 0, [], "cpu")


def test_parts_have_their_own_accumulators():
    values = np.ones(1001, np.float32)
    parts = accumulator_parts("cpu")
    totals = [wp.zeros(1, dtype=float, device="cpu") for _ in range(parts)]
    source = wp.array(values, dtype=float, device="cpu")
    launch(add_up, len(values), lambda part: [source, totals[part]], "cpu", parts=parts)
    assert sum(float(t.numpy()[0]) for t in totals) == 1001.0


@pytest.mark.parametrize(("count", "parts"), [(1, 4), (5, 2), (100, 7)])
def test_ranges_cover_all_indices_without_overlap(count, parts):
    ranges = _ranges(count, parts)
    assert [i for first, stop in ranges for i in range(first, stop)] == list(range(count))
    assert all(first < stop for first, stop in ranges)
