"""Types and small functions shared by the kernels. The scene fills the cube [-1, 1]^3."""

import warp as wp

vec8 = wp.types.vector(length=8, dtype=wp.float32)

# Below this, a direction component counts as parallel to the planes of its axis.
PARALLEL = wp.constant(1.0e-9)
FAR = wp.constant(1.0e9)
# Nothing nearer to the camera than this is seen, in cube units.
NEAR = wp.constant(1.0e-3)


@wp.func
def safe_inverse(x: float):
    """1 / x, and a huge number of x's sign where a ray runs parallel to a plane."""
    if wp.abs(x) < PARALLEL:
        return wp.where(x < 0.0, -FAR, FAR)
    return 1.0 / x


@wp.func
def cube_span(origin: wp.vec3, direction: wp.vec3, half: float):
    """(entry, exit) distances of a ray in the cube [-half, half]^3; entry > exit where it misses."""
    near = float(NEAR)
    far = float(FAR)
    for axis in range(3):
        if wp.abs(direction[axis]) < PARALLEL:
            if wp.abs(origin[axis]) > half:
                far = -1.0
        else:
            inverse = 1.0 / direction[axis]
            a = (-half - origin[axis]) * inverse
            b = (half - origin[axis]) * inverse
            near = wp.max(near, wp.min(a, b))
            far = wp.min(far, wp.max(a, b))
    return near, far


@wp.func
def corner_weight(corner: int, f: wp.vec3):
    """Trilinear weight of corner 0..7 (bits: x, y, z) at fraction f in [0, 1]^3."""
    wx = wp.where((corner & 4) != 0, f[0], 1.0 - f[0])
    wy = wp.where((corner & 2) != 0, f[1], 1.0 - f[1])
    wz = wp.where((corner & 1) != 0, f[2], 1.0 - f[2])
    return wx * wy * wz


@wp.func
def brick_place(i: int, j: int, k: int, bricks: int):
    """The place of an entry in brick order (core/field/bricks.py), in a grid of so many bricks per axis."""
    brick = ((i >> 2) * bricks + (j >> 2)) * bricks + (k >> 2)
    return (brick << 6) | ((i & 3) << 4) | ((j & 3) << 2) | (k & 3)


@wp.func
def corner_place(corner: int, low: wp.vec3i, high: wp.vec3i):
    """The place of corner 0..7 (bits: x, y, z) from what each axis adds to it at the lowest and the highest corner."""
    x = wp.where((corner & 4) != 0, high[0], low[0])
    y = wp.where((corner & 2) != 0, high[1], low[1])
    z = wp.where((corner & 1) != 0, high[2], low[2])
    return x + y + z


@wp.func
def nodes_around(p: wp.vec3, nodes: int):
    """(low, high, fraction) of a point of the cube in a grid of nodes^3, clamped to the grid; see `corner_place`."""
    s = float(nodes - 1) * 0.5
    top = float(nodes - 1) - 1.0e-3
    x = wp.clamp((p[0] + 1.0) * s, 0.0, top)
    y = wp.clamp((p[1] + 1.0) * s, 0.0, top)
    z = wp.clamp((p[2] + 1.0) * s, 0.0, top)
    i = int(x)
    j = int(y)
    k = int(z)
    b = (nodes + 3) >> 2
    low = wp.vec3i(brick_place(i, 0, 0, b), brick_place(0, j, 0, b), brick_place(0, 0, k, b))
    high = wp.vec3i(brick_place(i + 1, 0, 0, b), brick_place(0, j + 1, 0, b), brick_place(0, 0, k + 1, b))
    return low, high, wp.vec3(x - float(i), y - float(j), z - float(k))


@wp.func
def cell_of(p: wp.vec3, cells: int):
    """Flat index of the cell of a [cells]^3 grid that holds a point of the cube, clamped to the grid."""
    s = float(cells) * 0.5
    i = wp.clamp(int((p[0] + 1.0) * s), 0, cells - 1)
    j = wp.clamp(int((p[1] + 1.0) * s), 0, cells - 1)
    k = wp.clamp(int((p[2] + 1.0) * s), 0, cells - 1)
    return (i * cells + j) * cells + k
