"""What can go without changing what any lookup finds."""

from hashlib import blake2b

import numpy as np

from core.conventions import is_opaque
from exporters.compaction.quads import CHANNELS, TEXELS_AT_ONCE, Patches, Quads, slices

DIGEST_BYTES = 16  # two different patches never meet


def without_empty(quads: Quads) -> Quads:
    """Without quads whose texels are all holes; at least one quad stays."""
    patches = quads.patches
    solid = np.maximum.reduceat(is_opaque(patches.texels), patches.offsets)[quads.patch]
    solid[0] |= not solid.any()
    return quads.subset(solid)


def with_constant_axes_collapsed(patches: Patches) -> Patches:
    """A patch whose rows (columns) are all equal has one: every lookup finds the same."""
    sizes = patches.sizes.copy()
    for numbers in patches.groups():
        texels = patches.content(numbers)
        sizes[numbers, 0] = np.where(_all_equal(texels), 1, sizes[numbers, 0])
        sizes[numbers, 1] = np.where(_all_equal(texels.swapaxes(1, 2)), 1, sizes[numbers, 1])
    return patches if np.array_equal(sizes, patches.sizes) else cropped(patches, np.arange(len(sizes)), sizes)


def _all_equal(texels: np.ndarray) -> np.ndarray:
    """[n] bool: along axis 1 of [n, h, w, c]. Most patches show at their ends that they are not."""
    equal: np.ndarray = (texels[:, -1] == texels[:, 0]).all((1, 2))
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
    patches, (in_use, number) = quads.patches, np.unique(quads.patch, return_inverse=True)
    raw = patches.texels.reshape(-1).data
    ends = CHANNELS * (patches.offsets + patches.areas)
    texts = zip(
        patches.sizes[in_use, 0].tolist(),
        (CHANNELS * patches.offsets[in_use]).tolist(),
        ends[in_use].tolist(),
        strict=True,
    )
    found: dict[tuple[int, bytes], int] = {}  # by height and content: the new number
    new, kept = np.empty(len(in_use), np.int64), list[int]()
    for old, (height, start, end) in enumerate(texts):
        key = (height, blake2b(raw[start:end], digest_size=DIGEST_BYTES).digest())
        new[old] = found.setdefault(key, len(found))
        if new[old] == len(kept):
            kept.append(old)
    if len(kept) < len(patches.sizes):
        numbers = in_use[kept]
        patches = cropped(patches, numbers, patches.sizes[numbers])
    return Quads(quads.corners, quads.ends, quads.triangles, new[number], patches)
