"""What can go without changing what any lookup finds."""

from hashlib import blake2b

import numpy as np

from core.conventions import is_opaque
from exporters.compaction.quads import CHANNELS, TEXELS_AT_ONCE, Patches, Quads, slices
from exporters.compaction.windows import as_bytes, as_items, windows
from exporters.threads import mapped

DIGEST_BYTES = 16  # two different patches never meet
LOOKED_AT = 8  # texels


def without_empty(quads: Quads) -> Quads:
    """Without quads whose texels are all holes; at least one quad stays."""
    patches = quads.patches
    solid = np.maximum.reduceat(is_opaque(patches.texels), patches.offsets)[quads.patch]
    solid[0] |= not solid.any()
    return quads.subset(solid)


def with_constant_axes_collapsed(patches: Patches) -> Patches:
    """A patch whose rows (columns) are all equal has one: every lookup finds the same."""
    groups = list(patches.groups())
    sizes = patches.sizes.copy()
    for numbers, collapsed in zip(groups, mapped(lambda some: _collapsed(patches.content(some)), groups), strict=True):
        sizes[numbers] = collapsed
    return patches if np.array_equal(sizes, patches.sizes) else cropped(patches, np.arange(len(sizes)), sizes)


def _collapsed(texels: np.ndarray) -> np.ndarray:
    """[n, 2] sizes of patches [n, h, w, c] without the rows and columns that repeat the first."""
    _, height, width, _ = texels.shape
    return np.stack([np.where(_all_equal(texels), 1, height), np.where(_all_equal(texels.swapaxes(1, 2)), 1, width)], 1)


def _all_equal(texels: np.ndarray) -> np.ndarray:
    """[n] bool: along axis 1 of [n, h, w, c]. Most patches show at two texels that they are not."""
    equal: np.ndarray = (texels[:, -1, -1] == texels[:, 0, -1]).all(1)
    some = np.flatnonzero(equal)
    equal[some] = (texels[some] == texels[some, :1]).all((1, 2, 3))
    return equal


def cropped(patches: Patches, numbers: np.ndarray, sizes: np.ndarray) -> Patches:
    """The first rows and columns of patches `numbers` [n], `sizes` [n, 2] of them."""
    result = Patches(sizes, np.empty((int(sizes.prod(1).sum()), CHANNELS), np.uint8))
    both = np.concatenate([patches.sizes[numbers], sizes], 1)
    for before in np.unique(both, axis=0):
        equal = np.flatnonzero((both == before).all(1))
        height, width = before[2:]
        for part in slices(len(equal), TEXELS_AT_ONCE // int(before[:2].prod())):
            texels = patches.content(numbers[equal[part]])[:, :height, :width]
            result.place(equal[part], texels)
    return result


def with_equal_patches_shared(quads: Quads) -> Quads:
    """Only the patches in use, each once, in their order."""
    in_use, number = np.unique(quads.patch, return_inverse=True)
    patches = quads.patches.subset(in_use)
    first = _first_equal(patches)
    kept = np.flatnonzero(first == np.arange(len(first)))
    new = np.empty(len(first), np.int64)
    new[kept] = np.arange(len(kept))
    return Quads(quads.corners, quads.ends, quads.triangles, new[first][number], patches.subset(kept))


def _first_equal(patches: Patches) -> np.ndarray:
    """[N] int: the first patch that has a patch's size and content.

    Only what agrees in a few texels is gone through: where hardly anything is shared, a hundredth of the bytes.
    """
    looks, first = _looks(patches), np.arange(len(patches.sizes))
    _, look, count = np.unique(looks, return_inverse=True, return_counts=True)
    again = np.flatnonzero(count[look] > 1)
    heights, starts, areas = patches.sizes[again, 0], patches.offsets[again], patches.areas[again]
    raw = patches.texels.reshape(-1).data
    found: dict[tuple[int, bytes], int] = {}  # by height and content
    for number, height, start, end in zip(
        again.tolist(),
        heights.tolist(),
        (CHANNELS * starts).tolist(),
        (CHANNELS * (starts + areas)).tolist(),
        strict=True,
    ):
        key = (height, blake2b(raw[start:end], digest_size=DIGEST_BYTES).digest())
        first[number] = found.setdefault(key, number)
    return first


def _looks(patches: Patches) -> np.ndarray:
    """[N] items that are equal wherever patches are: their sizes and some texels."""
    looks = np.empty((len(patches.sizes), LOOKED_AT), np.dtype((np.void, CHANNELS)))
    for column, share in enumerate(np.linspace(0, 1, LOOKED_AT)):
        looks[:, column] = windows(patches.texels, 1)[
            patches.offsets + np.rint(share * (patches.areas - 1)).astype(int)
        ]
    sizes = patches.sizes.astype(np.uint16).view(np.uint8)
    return as_items(np.concatenate([sizes, as_bytes(looks).reshape(len(looks), -1)], 1), 1)
