"""What can go without changing what any lookup finds."""

import numpy as np

from core.conventions import is_opaque
from exporters.compaction.quads import CHANNELS, Patches, Quads

TEXELS_AT_ONCE = 1 << 20


def without_empty(quads: Quads) -> Quads:
    """Without quads whose texels are all holes; at least one quad stays."""
    patches = quads.patches
    solid = np.maximum.reduceat(is_opaque(patches.texels), patches.offsets)[quads.patch]
    solid[0] |= not solid.any()
    return quads.subset(solid)


def with_constant_axes_collapsed(patches: Patches) -> Patches:
    """A patch whose rows (columns) are all equal has one: every lookup finds the same."""
    sizes = patches.sizes.copy()
    for numbers, texels in patches.by_size(TEXELS_AT_ONCE):
        sizes[numbers, 0] = np.where((texels == texels[:, :1]).all((1, 2, 3)), 1, sizes[numbers, 0])
        sizes[numbers, 1] = np.where((texels == texels[:, :, :1]).all((1, 2, 3)), 1, sizes[numbers, 1])
    return patches if np.array_equal(sizes, patches.sizes) else cropped(patches, sizes)


def cropped(patches: Patches, sizes: np.ndarray) -> Patches:
    """The first rows and columns of each patch, `sizes` [N, 2] of them."""
    result = Patches(sizes, np.empty((int(sizes.prod(1).sum()), CHANNELS), np.uint8))
    offsets = result.offsets
    for numbers, texels in patches.by_size(TEXELS_AT_ONCE):
        for height, width in np.unique(sizes[numbers], axis=0):
            here = (sizes[numbers] == (height, width)).all(1)
            to = offsets[numbers[here]][:, None] + np.arange(height * width)
            result.texels[to] = texels[here, :height, :width].reshape(-1, height * width, CHANNELS)
    return result


def with_equal_patches_shared(quads: Quads) -> Quads:
    """Only the patches in use, each once, in the order of their first use."""
    patches = quads.patches
    raw, areas = patches.texels.reshape(-1).data, patches.areas
    starts, ends = (CHANNELS * patches.offsets).tolist(), (CHANNELS * (patches.offsets + areas)).tolist()
    heights = patches.sizes[:, 0].tolist()
    numbers: dict[tuple[int, bytes], int] = {}  # by height and content: the new number
    new, kept = np.full(len(areas), -1), list[int]()
    for old in quads.patch.tolist():
        if new[old] < 0:
            key = (heights[old], bytes(raw[starts[old] : ends[old]]))
            new[old] = numbers.setdefault(key, len(numbers))
            if new[old] == len(kept):
                kept.append(old)
    return Quads(quads.corners, quads.ends, quads.triangles, new[quads.patch], _chosen(patches, np.array(kept)))


def _chosen(patches: Patches, numbers: np.ndarray) -> Patches:
    sizes = patches.sizes[numbers]
    areas = sizes.prod(1)
    within = np.arange(int(areas.sum())) - np.repeat(np.cumsum(areas) - areas, areas)
    return Patches(sizes, patches.texels[np.repeat(patches.offsets[numbers], areas) + within])
