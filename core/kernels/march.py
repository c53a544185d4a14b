"""Ray marching through a voxel grid of density and features, and its gradient by hand.

Symbols: a sample n of a ray has opacity a_n = 1 - exp(-relu(raw) * density_scale * step), transmittance
T_n = prod_{m<n} (1 - a_m), weight w_n = T_n a_n. A ray yields F = sum w_n f_n and A = sum w_n (eq. 2).

Steps are even in the grid, not in the scene: where the grid is warped (core/field/space.py), a ray's way bends through
it, and a step's length along the ray follows the grid's own speed there. Opacity and the distortion loss measure
distance s in the grid; in a cube, s = t.

Gradient without division: with s_n = dL/dw_n and B_n = what lies behind (B_last = 0,
B_{n-1} = a_n s_n + (1 - a_n) B_n), dL/da_n = T_n (s_n - B_n).
"""

import warp as wp

from core.kernels.space import (
    CUBE,
    SHELLS,
    Space,
    grid_span,
    grid_velocity,
    largest_axis,
    nearest_shell_cell,
    to_cells,
    to_grid,
)
from core.kernels.types import FAR, cell_of, corner_place, corner_weight, nodes_around, safe_inverse, vec8

wp.set_module_options({"enable_backward": False, "fast_math": True})

# A dead ReLU gets no gradient: samples this far below zero are still recorded, with opacity 0.
LEAK = wp.constant(-0.12)
# Light that is left when a ray stops.
OPAQUE = wp.constant(1.0e-3)
# Samples that weigh less leave the features alone: their gradient is noise.
MIN_FEATURE_WEIGHT = wp.constant(1.0e-4)


@wp.struct
class VoxelGrid:
    space: Space
    nodes: int  # per axis
    density: wp.array(dtype=float)  # raw, [places] (core/field/bricks.py)
    features: wp.array(dtype=vec8)  # [places]
    row_of: wp.array(dtype=wp.int32)  # [places], where a node's gradient goes, or -1
    cells: int  # of the occupancy grid, per axis
    occupied: wp.array(dtype=wp.uint8)  # [cells^3]
    step: float
    density_scale: float


@wp.struct
class Samples:
    t: wp.array2d(dtype=float)  # [rays, capacity], along the ray
    s: wp.array2d(dtype=float)  # in the grid
    alpha: wp.array2d(dtype=float)
    transmittance: wp.array2d(dtype=float)
    features: wp.array2d(dtype=vec8)
    count: wp.array(dtype=int)  # [rays]; capacity + 1 where a ray needed more


@wp.func
def step_along(grid: VoxelGrid, p: wp.vec3, d: wp.vec3):
    """How far a ray goes, in the scene, in one step through the grid."""
    if grid.space.kind == CUBE:
        return grid.step
    return grid.step / wp.length(grid_velocity(grid.space, p, d))


@wp.func
def steps_to_next_cell(space: Space, p: wp.vec3, d: wp.vec3, cells: int, step: float):
    """Whole steps that take a ray out of its cell, at least 1; always 1 where its way bends."""
    if space.kind != CUBE:
        return 1.0
    size = 2.0 / float(cells)
    leave = float(FAR)
    for axis in range(3):
        inverse = safe_inverse(d[axis])
        j = wp.floor((p[axis] + 1.0) / size)
        boundary = wp.where(d[axis] > 0.0, j + 1.0, j) * size - 1.0
        if wp.abs(inverse) < FAR:
            leave = wp.min(leave, (boundary - p[axis]) * inverse)
    return wp.max(wp.ceil(leave / step), 1.0)


@wp.kernel
def march_forward(
    first: int,
    grid: VoxelGrid,
    origins: wp.array(dtype=wp.vec3),
    directions: wp.array(dtype=wp.vec3),
    jitter: wp.array(dtype=float),
    samples: Samples,
    features: wp.array(dtype=vec8),
    alpha: wp.array(dtype=float),
):
    r = first + wp.tid()
    o = origins[r]
    d = directions[r]
    t, stop = grid_span(grid.space, o, d, 0.9999)
    if t < stop:
        t += jitter[r] * step_along(grid, o + t * d, d)
    s = t
    capacity = samples.t.shape[1]
    T = float(1.0)
    A = float(0.0)
    F = vec8()
    n = int(0)
    while t < stop:
        p = o + t * d
        g = to_grid(grid.space, p)
        advance = step_along(grid, p, d)
        if grid.occupied[cell_of(g, grid.cells)] == wp.uint8(0):
            steps = steps_to_next_cell(grid.space, p, d, grid.cells, grid.step)
            t += steps * advance
            s += steps * grid.step
        else:
            low, high, f = nodes_around(g, grid.nodes)
            raw = float(0.0)
            for c in range(8):
                raw += corner_weight(c, f) * grid.density[corner_place(c, low, high)]
            if raw > LEAK:
                if n == capacity:
                    n = capacity + 1
                    break
                feature = vec8()
                for c in range(8):
                    feature += corner_weight(c, f) * grid.features[corner_place(c, low, high)]
                a = float(0.0)
                if raw > 0.0:
                    a = 1.0 - wp.exp(-raw * grid.density_scale * grid.step)
                samples.t[r, n] = t
                samples.s[r, n] = s
                samples.alpha[r, n] = a
                samples.transmittance[r, n] = T
                samples.features[r, n] = feature
                n += 1
                F += (T * a) * feature
                A += T * a
                T *= 1.0 - a
                if T < OPAQUE:
                    break
            t += advance
            s += grid.step
    samples.count[r] = n
    features[r] = F
    alpha[r] = A


@wp.kernel
def march_backward(
    first: int,
    grid: VoxelGrid,
    origins: wp.array(dtype=wp.vec3),
    directions: wp.array(dtype=wp.vec3),
    samples: Samples,
    grad_F: wp.array(dtype=vec8),
    grad_A: wp.array(dtype=float),
    distortion: float,
    part: int,
    grad_density: wp.array2d(dtype=float),  # [parts, rows]
    grad_features: wp.array2d(dtype=vec8),
    touched: wp.array(dtype=wp.uint8),
):
    """Adds dL/dF . F + dL/dA A, and the distortion loss of mip-NeRF 360 (eq. 15) in O(samples), to the accumulators."""
    r = first + wp.tid()
    o = origins[r]
    d = directions[r]
    gF = grad_F[r]
    gA = grad_A[r]
    count = wp.min(samples.count[r], samples.t.shape[1])
    W = float(0.0)  # sums of w and w s over all samples
    Ws = float(0.0)
    for n in range(count):
        w = samples.transmittance[r, n] * samples.alpha[r, n]
        W += w
        Ws += w * samples.s[r, n]
    behind = float(0.0)
    W_behind = float(0.0)
    Ws_behind = float(0.0)
    for k in range(count):
        n = count - 1 - k
        s = samples.s[r, n]
        a = samples.alpha[r, n]
        T = samples.transmittance[r, n]
        w = T * a
        W_front = W - W_behind - w
        Ws_front = Ws - Ws_behind - w * s
        spread = s * W_front - Ws_front + Ws_behind - s * W_behind + w * grid.step / 3.0
        grad_w = gA + wp.dot(gF, samples.features[r, n]) + distortion * 2.0 * spread
        W_behind += w
        Ws_behind += w * s
        grad_alpha = T * (grad_w - behind)
        behind = a * grad_w + (1.0 - a) * behind
        grad_raw = grad_alpha * (1.0 - a) * grid.step * grid.density_scale
        low, high, f = nodes_around(to_grid(grid.space, o + samples.t[r, n] * d), grid.nodes)
        for c in range(8):
            row = grid.row_of[corner_place(c, low, high)]
            if row >= 0:
                weight = corner_weight(c, f)
                wp.atomic_add(grad_density, part, row, weight * grad_raw)
                if w > MIN_FEATURE_WEIGHT:
                    wp.atomic_add(grad_features, part, row, (weight * w) * gF)
                touched[row] = wp.uint8(1)


@wp.kernel
def survey(
    first: int,
    origins: wp.array(dtype=wp.vec3),
    directions: wp.array(dtype=wp.vec3),
    samples: Samples,
    space: Space,
    cells: int,
    shells: int,
    part: int,
    peak: wp.array2d(dtype=float),  # [parts, cells^3], largest w seen in the cell
    mass: wp.array2d(dtype=float),  # [parts, cells^3], sum of w
    moment: wp.array2d(dtype=wp.vec3),  # [parts, cells^3], sum of w times the place among the cells
    shell_peak: wp.array2d(dtype=float),  # [parts, (shells + 1) * 6 * cells^2], largest w seen near the shell's cell
):
    """What the rays saw in each cell of the mesh, and of the shells around it."""
    r = first + wp.tid()
    left = float(1.0)
    for n in range(wp.min(samples.count[r], samples.t.shape[1])):
        w = samples.transmittance[r, n] * samples.alpha[r, n]
        left -= w
        if w > 1.0e-3:
            p = origins[r] + samples.t[r, n] * directions[r]
            if space.kind == SHELLS and wp.abs(p[largest_axis(p)]) > 1.0:
                wp.atomic_max(shell_peak, part, nearest_shell_cell(space, p, shells, cells), w)
            else:
                g = to_cells(space, p)
                cell = cell_of(g, cells)
                wp.atomic_max(peak, part, cell, w)
                wp.atomic_add(mass, part, cell, w)
                wp.atomic_add(moment, part, cell, w * g)
    if space.kind == SHELLS and left > 1.0e-3:
        _near, far = grid_span(space, origins[r], directions[r], 1.0)
        p = origins[r] + far * directions[r]
        wp.atomic_max(shell_peak, part, nearest_shell_cell(space, p, shells, cells), left)
