"""Adam (Kingma and Ba 2015) on the entries that a batch touched, with parameters kept within their range.

Entries that no ray touched keep their moments: an update without a gradient would be drift.
"""

import warp as wp

from core.kernels.space import Space, from_cells, gradient_in_cells, to_cells
from core.kernels.touched import is_listed_before
from core.kernels.types import vec8

wp.set_module_options({"enable_backward": False})

BETA1 = wp.constant(0.9)
TEXEL_BETA2 = wp.constant(0.99)  # short memory: a texel meets few rays
EPSILON = wp.constant(1.0e-12)


@wp.struct
class ScalarState:
    value: wp.array(dtype=float)
    grad: wp.array2d(dtype=float)  # [parts, rows]
    moment1: wp.array(dtype=float)
    moment2: wp.array(dtype=float)


@wp.struct
class FeatureState:
    value: wp.array(dtype=vec8)
    grad: wp.array2d(dtype=vec8)
    moment1: wp.array(dtype=vec8)
    moment2: wp.array(dtype=vec8)


@wp.func
def update_scalar(
    s: ScalarState, i: int, row: int, rate: float, decay: float, low: float, high: float, beta2: float, bias: wp.vec2
):
    """One step of entry i, whose gradient and moments are in `row`, within [low, high]; its gradient is cleared.

    value -= rate * (m / sqrt(v) + decay)
    """
    g = float(0.0)
    for p in range(s.grad.shape[0]):
        g += s.grad[p, row]
        s.grad[p, row] = 0.0
    m = BETA1 * s.moment1[row] + (1.0 - BETA1) * g
    v = beta2 * s.moment2[row] + (1.0 - beta2) * g * g
    s.moment1[row] = m
    s.moment2[row] = v
    m_hat = m / bias[0]
    v_hat = v / bias[1]
    s.value[i] = wp.clamp(s.value[i] - rate * (m_hat / (wp.sqrt(v_hat) + EPSILON) + decay), low, high)


@wp.func
def update_features(s: FeatureState, i: int, row: int, rate: float, beta2: float, bias: wp.vec2):
    """One step of the eight features of entry i, within [0, 1], channel 0 from 1/255 (0 is a hole)."""
    g = vec8()
    for p in range(s.grad.shape[0]):
        g += s.grad[p, row]
        s.grad[p, row] = vec8()
    m = BETA1 * s.moment1[row] + (1.0 - BETA1) * g
    v = beta2 * s.moment2[row] + (1.0 - beta2) * wp.cw_mul(g, g)
    s.moment1[row] = m
    s.moment2[row] = v
    scale1 = rate / bias[0]
    scale2 = 1.0 / bias[1]
    x = s.value[i]
    for c in range(8):
        x[c] = wp.clamp(x[c] - scale1 * m[c] / (wp.sqrt(v[c] * scale2) + EPSILON), 0.0, 1.0)
    x[0] = wp.max(x[0], 1.0 / 255.0)
    s.value[i] = x


@wp.kernel
def adam_grid(
    first: int,
    trained: wp.array(dtype=wp.int32),  # [rows]
    touched: wp.array(dtype=wp.uint8),
    scalars: ScalarState,
    features: FeatureState,
    scalar_rate: float,
    feature_rate: float,
    scalar_decay: float,
    low: float,
    high: float,
    beta2: float,
    bias: wp.vec2,
):
    """Steps the touched ones among the rows of a grid."""
    row = first + wp.tid()
    if touched[row] == wp.uint8(0):
        return
    touched[row] = wp.uint8(0)
    i = trained[row]
    update_scalar(scalars, i, row, scalar_rate, scalar_decay, low, high, beta2, bias)
    update_features(features, i, row, feature_rate, beta2, bias)


@wp.kernel
def adam_texels(
    first: int,
    touched: wp.array2d(dtype=wp.int32),  # [parts, capacity]
    stamp: wp.array2d(dtype=wp.int32),  # [parts, texels]: the last batch that touched a texel
    batch: int,
    part: int,
    scalars: ScalarState,
    features: FeatureState,
    updates: wp.array(dtype=wp.int32),
    scalar_rate: float,
    feature_rate: float,
):
    """Steps the texels on one part's list, except those that an earlier part lists too."""
    i = touched[part, first + wp.tid()]
    if is_listed_before(stamp, i, part, batch):
        return
    updates[i] = wp.min(updates[i] + 1, 10000)
    k = float(updates[i])
    bias = wp.vec2(1.0 - wp.pow(BETA1, k), 1.0 - wp.pow(TEXEL_BETA2, k))
    if scalar_rate > 0.0:
        update_scalar(scalars, i, i, scalar_rate, 0.0, 0.0, 1.0, TEXEL_BETA2, bias)
    update_features(features, i, i, feature_rate, TEXEL_BETA2, bias)


@wp.kernel
def adam_vertices(
    first: int,
    space: Space,
    value: wp.array(dtype=wp.vec3),
    grad: wp.array2d(dtype=wp.vec3),
    moment1: wp.array(dtype=wp.vec3),
    moment2: wp.array(dtype=wp.vec3),
    centre: wp.array(dtype=wp.vec3),
    reach: float,
    rate: float,
    pull: float,
    beta2: float,
    bias: wp.vec2,
):
    """Steps the vertices, keeps each within `reach` of its cell's centre, and pulls it back there a little (eq. 6).

    Steps, moments and centres are in the cells' cube; values and their gradients are in the scene.
    """
    i = first + wp.tid()
    g = wp.vec3()
    for p in range(grad.shape[0]):
        g += grad[p, i]
        grad[p, i] = wp.vec3()
    if wp.length_sq(g) == 0.0:
        return
    g = gradient_in_cells(space, value[i], g)
    m = BETA1 * moment1[i] + (1.0 - BETA1) * g
    v = beta2 * moment2[i] + (1.0 - beta2) * wp.cw_mul(g, g)
    moment1[i] = m
    moment2[i] = v
    x = to_cells(space, value[i]) - centre[i]
    for a in range(3):
        x[a] = wp.clamp(x[a] - rate * (m[a] / bias[0]) / (wp.sqrt(v[a] / bias[1]) + 1.0e-20), -reach, reach) * (
            1.0 - pull
        )
    value[i] = from_cells(space, centre[i] + x)


def bias_correction(steps: int, beta2: float) -> wp.vec2:
    """(1 - beta1^steps, 1 - beta2^steps): what moments lack after `steps` updates from zero."""
    return wp.vec2(1.0 - float(BETA1) ** steps, 1.0 - beta2**steps)
