"""The pull of features towards their neighbours', in a grid and in patches: gradients of core/oracles/smoothness.py."""

import warp as wp

from core.kernels.touched import is_listed_before
from core.kernels.types import brick_place, vec8

wp.set_module_options({"enable_backward": False})


@wp.func
def node_at(place: int, bricks: int):
    """The node at a place in brick order: the inverse of `brick_place`."""
    brick = place >> 6
    return wp.vec3i(
        ((brick // (bricks * bricks)) << 2) | ((place >> 4) & 3),
        (((brick // bricks) % bricks) << 2) | ((place >> 2) & 3),
        ((brick % bricks) << 2) | (place & 3),
    )


@wp.kernel
def smoothness_gradient(
    first: int,
    nodes: int,  # per axis
    weight: float,
    trained: wp.array(dtype=wp.int32),  # [rows], places in brick order (core/field/bricks.py)
    row_of: wp.array(dtype=wp.int32),  # [places], or -1
    touched: wp.array(dtype=wp.uint8),  # [rows]
    features: wp.array(dtype=vec8),  # [places]
    grad_features: wp.array2d(dtype=vec8),  # [parts, rows]
):
    """Adds the gradient to the first accumulator of the touched rows. Features are only read: ranges share nothing."""
    row = first + wp.tid()
    if touched[row] == wp.uint8(0):
        return
    place = trained[row]
    bricks = (nodes + 3) >> 2
    node = node_at(place, bricks)
    pull = vec8()
    for axis in range(3):
        for side in range(2):
            other = node
            other[axis] += 2 * side - 1
            # Warp evaluates both sides of an `and`: nested, nothing beyond the grid is read.
            if other[axis] >= 0 and other[axis] < nodes:
                neighbour = brick_place(other[0], other[1], other[2], bricks)
                if row_of[neighbour] >= 0:
                    pull += features[place] - features[neighbour]
    grad_features[0, row] += weight * pull


@wp.kernel
def texel_smoothness_gradient(
    first: int,
    touched: wp.array2d(dtype=wp.int32),  # [parts, capacity]
    stamp: wp.array2d(dtype=wp.int32),  # [parts, texels]: the last batch that touched a texel
    batch: int,
    part: int,
    K: int,  # texels a side of a patch
    weight: float,
    alpha: wp.array(dtype=float),  # [texels]
    features: wp.array(dtype=vec8),  # [texels]
    grad_features: wp.array2d(dtype=vec8),  # [parts, texels]
):
    """Adds the gradient of the texels on one part's list, except those that an earlier part lists too.

    Neighbours share a side and a patch, and both are opaque: what is in holes means nothing.
    """
    i = touched[part, first + wp.tid()]
    if is_listed_before(stamp, i, part, batch):
        return
    if alpha[i] <= 0.5:
        return
    pull = vec8()
    stride = int(1)
    for _axis in range(2):
        place = (i // stride) % K
        if place > 0:  # noqa: SIM102
            if alpha[i - stride] > 0.5:
                pull += features[i] - features[i - stride]
        if place < K - 1:  # noqa: SIM102
            if alpha[i + stride] > 0.5:
                pull += features[i] - features[i + stride]
        stride *= K
    grad_features[part, i] += weight * pull
