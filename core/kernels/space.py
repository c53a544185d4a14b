"""The parameterisations of space in kernels; core/field/space.py says what they are, and is the oracle."""

import warp as wp

from core.kernels.types import FAR, NEAR, PARALLEL, cube_span

wp.set_module_options({"enable_backward": False})

CUBE = wp.constant(0)
TAPER = wp.constant(1)
SHELLS = wp.constant(2)


@wp.struct
class Space:
    kind: int
    tangent: wp.vec2
    reach: float
    growth: float
    inner: float


@wp.func
def largest_axis(p: wp.vec3):
    """The axis of the component that is largest in size."""
    a = wp.abs(p[0])
    b = wp.abs(p[1])
    c = wp.abs(p[2])
    if a >= b and a >= c:
        return 0
    if b >= c:
        return 1
    return 2


@wp.func
def to_grid(space: Space, p: wp.vec3):
    """The grid point of a scene point."""
    if space.kind == TAPER:
        z = wp.max(p[2], 1.0e-6)
        return wp.vec3(
            p[0] / (z * space.tangent[0]), p[1] / (z * space.tangent[1]), 2.0 * wp.log(z) / space.growth - 1.0
        )
    if space.kind == SHELLS:
        m = wp.abs(p[largest_axis(p)])
        if m > 1.0:
            tau = wp.log(1.0 + space.growth * (m - 1.0)) / space.growth
            return p * ((space.inner + (1.0 - space.inner) * tau) / m)
        return p * space.inner
    return p


@wp.func
def grid_velocity(space: Space, p: wp.vec3, d: wp.vec3):
    """How fast the grid point moves as the scene point moves along d: the Jacobian of `to_grid` times d."""
    if space.kind == TAPER:
        z = wp.max(p[2], 1.0e-6)
        return wp.vec3(
            (d[0] - p[0] * d[2] / z) / (z * space.tangent[0]),
            (d[1] - p[1] * d[2] / z) / (z * space.tangent[1]),
            2.0 * d[2] / (z * space.growth),
        )
    if space.kind == SHELLS:
        axis = largest_axis(p)
        m = wp.abs(p[axis])
        if m > 1.0:
            dm = wp.where(p[axis] > 0.0, d[axis], -d[axis])
            slope = 1.0 + space.growth * (m - 1.0)
            radius = space.inner + (1.0 - space.inner) * wp.log(slope) / space.growth
            return p * ((1.0 - space.inner) / slope * dm / m - radius * dm / (m * m)) + d * (radius / m)
        return d * space.inner
    return d


@wp.func
def to_cells(space: Space, p: wp.vec3):
    """The point of the mesh's cells' cube [-1, 1]^3 of a scene point: the grid; for SHELLS the cube in its middle."""
    if space.kind == TAPER:
        return to_grid(space, p)
    return p


@wp.func
def from_cells(space: Space, g: wp.vec3):
    """The inverse of `to_cells`."""
    if space.kind == TAPER:
        z = wp.exp(space.growth * (g[2] + 1.0) * 0.5)
        return wp.vec3(g[0] * space.tangent[0] * z, g[1] * space.tangent[1] * z, z)
    return g


@wp.func
def gradient_in_cells(space: Space, p: wp.vec3, gradient: wp.vec3):
    """dL/d(to_cells(p)) of dL/dp: the transposed Jacobian of `from_cells` times the gradient."""
    if space.kind == TAPER:
        return wp.vec3(
            gradient[0] * space.tangent[0] * p[2],
            gradient[1] * space.tangent[1] * p[2],
            wp.dot(gradient, p) * space.growth * 0.5,
        )
    return gradient


@wp.func
def clipped(value: float, slope: float, near: float, far: float):
    """The part of [near, far] where value + slope t <= 0; empty (near > far) if there is none."""
    if wp.abs(slope) < PARALLEL:
        if value > 0.0:
            return near, -1.0
        return near, far
    t = -value / slope
    if slope > 0.0:
        return near, wp.min(far, t)
    return wp.max(near, t), far


@wp.func
def taper_span(space: Space, o: wp.vec3, d: wp.vec3, share: float):
    near = float(NEAR)
    far = float(FAR)
    near, far = clipped(1.0 - o[2], -d[2], near, far)
    near, far = clipped(o[2] - wp.exp(space.growth * share), d[2], near, far)
    for axis in range(2):
        tangent = space.tangent[axis] * share
        near, far = clipped(o[axis] - tangent * o[2], d[axis] - tangent * d[2], near, far)
        near, far = clipped(-o[axis] - tangent * o[2], -d[axis] - tangent * d[2], near, far)
    return near, far


@wp.func
def grid_span(space: Space, o: wp.vec3, d: wp.vec3, share: float):
    """(entry, exit) distances of a ray in the central `share` of the grid; entry > exit where it misses."""
    if space.kind == TAPER:
        return taper_span(space, o, d, share)
    return cube_span(o, d, share * space.reach)


@wp.func
def cells_span(space: Space, o: wp.vec3, d: wp.vec3, share: float):
    """(entry, exit) distances of a ray in the central `share` of the mesh's cells."""
    if space.kind == TAPER:
        return taper_span(space, o, d, share)
    return cube_span(o, d, share)


@wp.func
def heading(space: Space, o: wp.vec3, d: wp.vec3):
    """The sign, per axis, of a ray's way through the mesh's cells; it never turns back."""
    if space.kind == TAPER:
        return wp.vec3(d[0] * o[2] - o[0] * d[2], d[1] * o[2] - o[1] * d[2], d[2])
    return d


@wp.func
def face_axes(axis: int):
    """The two other axes, in order: along a and b of a quad on a face across `axis`."""
    if axis == 0:
        return 1, 2
    if axis == 1:
        return 0, 2
    return 0, 1


@wp.func
def shell_cell(shell: int, p: wp.vec3, cells: int):
    """(flat index among the cells of the shells' faces, place within the cell [0, 1]^2) of a point of a shell's cube.

    Faces go by axis, the negative one first; a face has cells^2 cells.
    """
    axis = largest_axis(p)
    half = wp.abs(p[axis])
    face = 2 * axis + wp.where(p[axis] > 0.0, 1, 0)
    first, second = face_axes(axis)
    a = (p[first] / half + 1.0) * 0.5 * float(cells)
    b = (p[second] / half + 1.0) * 0.5 * float(cells)
    i = wp.clamp(int(a), 0, cells - 1)
    j = wp.clamp(int(b), 0, cells - 1)
    return ((shell * 6 + face) * cells + i) * cells + j, wp.vec2(a - float(i), b - float(j))


@wp.func
def nearest_shell_cell(space: Space, p: wp.vec3, shells: int, cells: int):
    """The shells' cell next to a point outside of the mesh's cube."""
    m = wp.abs(p[largest_axis(p)])
    tau = wp.log(1.0 + space.growth * (m - 1.0)) / space.growth
    shell = wp.clamp(int(tau * float(shells) + 0.5), 0, shells)
    cell, _ab = shell_cell(shell, p, cells)
    return cell
