"""Patches copied as a whole, and those that are equal, against the same texel by texel."""

import numpy as np
import pytest

from exporters.compaction.quads import CHANNELS, Patches, Quads
from exporters.compaction.sharing import with_constant_axes_collapsed, with_equal_patches_shared
from exporters.compaction.windows import as_bytes, as_items, windows

SIZES = np.array([(2, 3), (3, 2), (1, 6), (4, 4)])


@pytest.fixture
def patches(rng: np.random.Generator) -> Patches:
    """Many that are equal, or equal but for their last texel's last byte or their size."""
    sizes = SIZES[rng.integers(0, len(SIZES), 200)]
    texels = np.zeros((int(sizes.prod(1).sum()), CHANNELS), np.uint8)
    made = Patches(sizes, texels)
    ends = made.offsets + made.areas
    texels[made.offsets, 0] = rng.integers(0, 3, 200)
    texels[ends - 1, -1] = rng.integers(0, 2, 200)
    texels[made.offsets + made.areas // 2, 5] = rng.integers(0, 2, 200)
    return made


def content(patches: Patches, number: int) -> tuple[tuple[int, ...], bytes]:
    start, area = patches.offsets[number], patches.areas[number]
    return tuple(patches.sizes[number]), patches.texels[start : start + area].tobytes()


def test_each_content_stays_once_and_in_order(patches: Patches, rng: np.random.Generator) -> None:
    shown = rng.integers(0, 200, 300)
    quads = Quads(np.zeros((300, 4, 3)), np.zeros((300, 4, 2), bool), np.zeros((300, 2, 3), np.uint32), shown, patches)
    shared = with_equal_patches_shared(quads)
    assert [content(shared.patches, n) for n in shared.patch] == [content(patches, n) for n in shown]
    kept = [content(shared.patches, n) for n in range(len(shared.patches.sizes))]
    assert kept == list(dict.fromkeys(content(patches, n) for n in np.unique(shown)))


def test_contents_are_the_texels_in_any_order(patches: Patches, rng: np.random.Generator) -> None:
    some = patches.subset(rng.permutation(200)[:120])
    for numbers in some.groups():
        for number, texels in zip(numbers, some.content(numbers), strict=True):
            assert (texels.shape[:2], texels.tobytes()) == content(some, number)


def test_placed_texels_are_found_again(patches: Patches) -> None:
    copy = Patches(patches.sizes, np.zeros_like(patches.texels))
    for numbers in patches.groups():
        copy.place(numbers[::-1], patches.content(numbers[::-1]))
    np.testing.assert_array_equal(copy.texels, patches.texels)


def test_axes_collapse_where_all_rows_or_columns_are_equal(rng: np.random.Generator) -> None:
    texels = rng.integers(0, 2, (400, 3, 3, CHANNELS), dtype=np.uint8) * (np.arange(CHANNELS) == 4).astype(np.uint8)
    collapsed = with_constant_axes_collapsed(Patches(np.full((400, 2), 3), texels.reshape(-1, CHANNELS)))
    expected = [[1 if (patch == patch[:1]).all() else 3, 1 if (patch == patch[:, :1]).all() else 3] for patch in texels]
    assert 1 in np.array(expected)
    np.testing.assert_array_equal(collapsed.sizes, expected)


def test_windows_are_runs_of_rows(rng: np.random.Generator) -> None:
    rows = rng.integers(0, 256, (9, 3), dtype=np.uint8)
    found = as_bytes(windows(rows, 4)[[5, 0]])
    np.testing.assert_array_equal(found, [rows[5:].ravel(), rows[:4].ravel()])
    windows(rows, 2)[[7, 1]] = as_items(np.arange(12, dtype=np.uint8).reshape(2, 2, 3), 1)
    np.testing.assert_array_equal(rows[[7, 8, 1, 2]].ravel(), np.arange(12))
    assert len(windows(rows, 10)) == 0
