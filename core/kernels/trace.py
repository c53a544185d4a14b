"""Ray tracing a quad mesh whose vertices stay within their cells (supplement G).

A ray walks through the cells of the P grid (Amanatides and Woo 1987). Each kept cell lists the at most twelve quads
that use its vertex; a hit counts only if it lies within that cell's stretch of the ray. A quad lies in the block of its
four cells, so every hit is found exactly once and in order.

Cells are bounded by planes in every parameterisation (core/field/space.py), and a ray crosses those of an axis in one
direction only. Shells, where there are any, are cubes around everything else: a ray from within leaves each once.

Triangles are hit by edge functions in a frame aligned with the ray; the two triangles of a quad share its diagonal, so
that no ray slips between them.
"""

from collections.abc import Callable
from functools import cache
from typing import Any

import warp as wp

from core.kernels.space import TAPER, Space, cells_span, heading, shell_cell, to_cells
from core.kernels.types import FAR, NEAR, PARALLEL, brick_place, vec8

OPTIONS = {"enable_backward": False, "fast_math": True}
wp.set_module_options(OPTIONS)

# Light that is left when the continuous model stops.
OPAQUE = wp.constant(1.0e-2)


@wp.struct
class QuadMesh:
    """A quad's corners stand in the order 00, 01, 10, 11 of its (a, b) coordinates; its diagonal runs from 00 to 11."""

    space: Space
    cells: int  # P, per axis
    bricks: int  # per axis, of the cells (core/field/bricks.py)
    cell_distance: wp.array(dtype=wp.uint8)  # [places], cells to the nearest kept cell, 0 in one
    cell_slot: wp.array(dtype=wp.int32)  # [places] -> slot of a kept cell
    slot_start: wp.array(dtype=wp.int32)  # [slots + 1] into slot_quads
    slot_quads: wp.array(dtype=wp.int32)
    quads: wp.array(dtype=wp.vec4i)  # [Q] -> vertices
    vertices: wp.array(dtype=wp.vec3)
    balls: wp.array(dtype=wp.vec4)  # [Q], centre and squared radius of a ball around each quad
    movable: int  # vertices from here on stay where they are
    shell_halves: wp.array(dtype=float)  # [shells], half edges, growing
    shell_quads: wp.array(dtype=wp.int32)  # [shells * 6 * P^2] -> quad, or -1


@wp.struct
class Hits:
    """Along each ray, front to back."""

    quad: wp.array2d(dtype=wp.int32)  # [rays, capacity]
    ab: wp.array2d(dtype=wp.vec2)  # place on the quad, [0, 1]^2
    t: wp.array2d(dtype=float)
    alpha: wp.array2d(dtype=float)
    transmittance: wp.array2d(dtype=float)
    features: wp.array2d(dtype=vec8)
    count: wp.array(dtype=wp.int32)  # [rays]


@wp.func
def corner_weights(ab: wp.vec2):
    """Barycentric weights of corners 00, 01, 10, 11 at (a, b); the diagonal's triangles meet at a = b."""
    a = ab[0]
    b = ab[1]
    if b >= a:
        return wp.vec4(1.0 - b, b - a, 0.0, a)
    return wp.vec4(1.0 - a, 0.0, a - b, b)


@wp.func
def into_frame(p: wp.vec3, e1: wp.vec3, e2: wp.vec3, d: wp.vec3):
    return wp.vec3(wp.dot(p, e1), wp.dot(p, e2), wp.dot(p, d))


@wp.func
def hit_triangle(v0: wp.vec3, vm: wp.vec3, v3: wp.vec3):
    """(t, weight of vm, weight of v3) where the frame's z axis meets a triangle; t < 0 where it misses."""
    w0 = vm[0] * v3[1] - vm[1] * v3[0]
    wm = v3[0] * v0[1] - v3[1] * v0[0]
    w3 = v0[0] * vm[1] - v0[1] * vm[0]
    area = w0 + wm + w3
    inside = (w0 >= 0.0 and wm >= 0.0 and w3 >= 0.0) or (w0 <= 0.0 and wm <= 0.0 and w3 <= 0.0)
    if area == 0.0 or not inside:
        return wp.vec3(-1.0, 0.0, 0.0)
    inverse = 1.0 / area
    return wp.vec3((w0 * v0[2] + wm * vm[2] + w3 * v3[2]) * inverse, wm * inverse, w3 * inverse)


@wp.func
def hit_quad(mesh: QuadMesh, quad: int, o: wp.vec3, e1: wp.vec3, e2: wp.vec3, d: wp.vec3):
    """(t, a, b) where the ray meets each of a quad's triangles; t < 0 where it misses. A folded quad is met twice."""
    q = mesh.quads[quad]
    v0 = into_frame(mesh.vertices[q[0]] - o, e1, e2, d)
    v3 = into_frame(mesh.vertices[q[3]] - o, e1, e2, d)
    first = hit_triangle(v0, into_frame(mesh.vertices[q[1]] - o, e1, e2, d), v3)
    second = hit_triangle(v0, into_frame(mesh.vertices[q[2]] - o, e1, e2, d), v3)
    if first[0] > 0.0 and second[1] == 0.0:  # a hit on the diagonal is one hit
        second = wp.vec3(-1.0, 0.0, 0.0)
    return wp.vec3(first[0], first[2], first[1] + first[2]), wp.vec3(second[0], second[1] + second[2], second[2])


@wp.func
def meets_ball(ball: wp.vec4, o: wp.vec3, d: wp.vec3):
    """Whether the line of a ray meets a ball: most quads near a ray are ruled out by this alone."""
    c = wp.vec3(ball[0], ball[1], ball[2]) - o
    along = wp.dot(c, d)
    across = c - along * d
    return wp.dot(across, across) <= ball[3]


@wp.kernel
def bound_quads(first: int, mesh: QuadMesh):
    """Puts a ball around each quad; to be run whenever vertices have moved."""
    q = first + wp.tid()
    corner = mesh.quads[q]
    centre = 0.25 * (
        mesh.vertices[corner[0]] + mesh.vertices[corner[1]] + mesh.vertices[corner[2]] + mesh.vertices[corner[3]]
    )
    reach = float(0.0)
    for i in range(4):
        reach = wp.max(reach, wp.length_sq(mesh.vertices[corner[i]] - centre))
    # float32 resolves a ray's distance from the ball to about 1e-6 of the cube
    mesh.balls[q] = wp.vec4(centre[0], centre[1], centre[2], reach * 1.001 + 1.0e-10)


@wp.func
def insert_hit(hits: Hits, r: int, lowest: int, n: int, quad: int, hit: wp.vec3, t: float, t_leave: float):
    """Puts a hit, if it lies within [t, t_leave), among the hits lowest..n-1 of ray r, sorted by distance.

    Returns the number of hits; where there is no room for one more, the farthest goes.
    """
    if hit[0] <= 0.0 or hit[0] < t or hit[0] >= t_leave:
        return n
    m = wp.min(n, hits.t.shape[1] - 1)
    if m < n and hits.t[r, m] <= hit[0]:
        return n
    count = m + 1
    while m > lowest and hits.t[r, wp.max(m - 1, 0)] > hit[0]:
        hits.t[r, m] = hits.t[r, m - 1]
        hits.quad[r, m] = hits.quad[r, m - 1]
        hits.ab[r, m] = hits.ab[r, m - 1]
        m -= 1
    hits.t[r, m] = hit[0]
    hits.quad[r, m] = quad
    hits.ab[r, m] = wp.vec2(hit[1], hit[2])
    return count


@wp.func
def cell_at(p: wp.vec3, P: int):
    s = float(P) * 0.5
    return wp.vec3i(
        wp.clamp(int((p[0] + 1.0) * s), 0, P - 1),
        wp.clamp(int((p[1] + 1.0) * s), 0, P - 1),
        wp.clamp(int((p[2] + 1.0) * s), 0, P - 1),
    )


@wp.func
def plane_distance(value: float, slope: float):
    """t where value + slope t = 0; FAR where that lies behind, or the ray runs parallel to the plane."""
    if wp.abs(slope) < PARALLEL:
        return float(FAR)
    t = -value / slope
    return wp.where(t < 0.0, float(FAR), t)


@wp.func
def side_distance(slope: float, o: wp.vec3, d: wp.vec3, axis: int):
    """t where a ray crosses the plane x_axis = slope z of tapered cells; FAR where that is not before the cameras."""
    t = plane_distance(o[axis] - slope * o[2], d[axis] - slope * d[2])
    return wp.where(o[2] + t * d[2] < 0.5, float(FAR), t)  # the cells begin at z = 1; behind 0 the plane goes on


@wp.func
def side_coordinate(way: float, cell: int, reach: int, size: float):
    """Where, along one axis of the cells' cube, the far side lies of the block of cells less than `reach` from one."""
    return float(wp.where(way > 0.0, cell + reach, cell - reach + 1)) * size - 1.0


@wp.func
def block_exit(space: Space, o: wp.vec3, d: wp.vec3, way: wp.vec3, cell: wp.vec3i, reach: int, size: float):
    """Where a ray passes the far sides of the block of cells less than `reach` from a cell, per axis."""
    x = side_coordinate(way[0], cell[0], reach, size)
    y = side_coordinate(way[1], cell[1], reach, size)
    z = side_coordinate(way[2], cell[2], reach, size)
    if space.kind == TAPER:
        depth = wp.exp(space.growth * (z + 1.0) * 0.5)
        return wp.vec3(
            side_distance(x * space.tangent[0], o, d, 0),
            side_distance(y * space.tangent[1], o, d, 1),
            plane_distance(o[2] - depth, d[2]),
        )
    return wp.vec3(plane_distance(o[0] - x, d[0]), plane_distance(o[1] - y, d[1]), plane_distance(o[2] - z, d[2]))


@wp.func
def next_along(g: float, way: float, cell: int, reach: int, crossed: bool, half_cells: float):
    """The next cell along one axis: just outside of the block where the ray crossed its side, else within it."""
    outside = wp.where(way > 0.0, cell + reach, cell - reach)
    inside = wp.clamp(int((g + 1.0) * half_cells), cell - reach + 1, cell + reach - 1)
    return wp.where(crossed, outside, inside)


@wp.func
def next_cell(g: wp.vec3, way: wp.vec3, cell: wp.vec3i, reach: int, leave: wp.vec3, half_cells: float):
    """The cell behind the block of cells around `cell` that the ray leaves at g; P or -1 outside of the cells."""
    crosses_x = leave[0] <= leave[1] and leave[0] <= leave[2]
    crosses_y = not crosses_x and leave[1] <= leave[2]
    crosses_z = not crosses_x and not crosses_y
    return wp.vec3i(
        next_along(g[0], way[0], cell[0], reach, crosses_x, half_cells),
        next_along(g[1], way[1], cell[1], reach, crosses_y, half_cells),
        next_along(g[2], way[2], cell[2], reach, crosses_z, half_cells),
    )


@wp.func
def cube_exit(half: float, o: wp.vec3, d: wp.vec3):
    """Where a ray from within the cube [-half, half]^3 leaves it; not positive where it lies behind."""
    leave = float(FAR)
    for axis in range(3):
        if wp.abs(d[axis]) >= PARALLEL:
            side = wp.where(d[axis] > 0.0, half, -half)
            leave = wp.min(leave, (side - o[axis]) / d[axis])
    return leave


@wp.func
def perpendicular(d: wp.vec3):
    """A unit vector at right angles to d."""
    if wp.abs(d[0]) < 0.6:
        return wp.normalize(wp.cross(wp.vec3(1.0, 0.0, 0.0), d))
    return wp.normalize(wp.cross(wp.vec3(0.0, 1.0, 0.0), d))


@cache
def trace_kernel(alpha_of: Callable[..., float], surface_type: Any) -> wp.Kernel:
    """The kernel that finds a ray's hits on a mesh whose opacity at a hit is `alpha_of(surface, quad, ab, point)`.

    It records every hit until the light is used up: for the binary model until the second opaque hit (the first one's
    opacity gradient needs what lies behind it), for both models until the continuous one's light is used up as well, or
    until the hits' capacity is reached.
    """

    @wp.kernel(module="unique", module_options=OPTIONS)
    def trace(
        first: int,
        mesh: QuadMesh,
        surface: surface_type,
        origins: wp.array(dtype=wp.vec3),
        directions: wp.array(dtype=wp.vec3),
        binary_only: int,
        hits: Hits,
    ):
        r = first + wp.tid()
        o = origins[r]
        d = directions[r]
        capacity = hits.t.shape[1]
        P = mesh.cells
        t, stop = cells_span(mesh.space, o, d, 0.99999)
        e1 = perpendicular(d)
        e2 = wp.cross(d, e1)
        way = heading(mesh.space, o, d)
        size = 2.0 / float(P)
        half_cells = 0.5 * float(P)
        cell = cell_at(to_cells(mesh.space, o + t * d), P)
        place = brick_place(cell[0], cell[1], cell[2], mesh.bricks)
        distance = int(mesh.cell_distance[place])
        T = float(1.0)
        opaque = int(0)
        n = int(0)
        lit = bool(True)
        alive = t < stop
        while alive:
            # An empty cell tells how far around it all others are empty too: leave that block in one go.
            reach = wp.max(distance, 1)
            leave = block_exit(mesh.space, o, d, way, cell, reach, size)
            t_leave = wp.min(leave)
            here = place
            is_kept = distance == 0
            cell = next_cell(to_cells(mesh.space, o + t_leave * d), way, cell, reach, leave, half_cells)
            outside = wp.min(cell) < 0 or wp.max(cell) >= P
            # Asked for already now: memory answers while this cell's quads are looked at.
            if not outside:
                place = brick_place(cell[0], cell[1], cell[2], mesh.bricks)
                distance = int(mesh.cell_distance[place])
            if is_kept:
                lowest = n
                slot = mesh.cell_slot[here]
                start = mesh.slot_start[slot]
                stop_at = mesh.slot_start[slot + 1]
                candidates = int(0)  # without a branch, so that memory fetches all balls at once
                for k in range(start, stop_at):
                    candidates |= wp.where(meets_ball(mesh.balls[mesh.slot_quads[k]], o, d), 1, 0) << (k - start)
                for k in range(start, stop_at):
                    if (candidates >> (k - start)) & 1 == 1:
                        quad = mesh.slot_quads[k]
                        first_hit, second_hit = hit_quad(mesh, quad, o, e1, e2, d)
                        n = insert_hit(hits, r, lowest, n, quad, first_hit, t, t_leave)
                        n = insert_hit(hits, r, lowest, n, quad, second_hit, t, t_leave)
                m = int(lowest)
                while m < n:
                    alpha = alpha_of(surface, hits.quad[r, m], hits.ab[r, m], o + hits.t[r, m] * d)
                    hits.alpha[r, m] = alpha
                    hits.transmittance[r, m] = T
                    T *= 1.0 - alpha
                    if alpha > 0.5:
                        opaque += 1
                    m += 1
                    if opaque >= 2 and (binary_only == 1 or T < OPAQUE):
                        n = m
                        lit = False
            t = t_leave
            alive = lit and t < stop and n < capacity and not outside
        shell = int(0)
        while lit and n < capacity and shell < mesh.shell_halves.shape[0]:
            t = cube_exit(mesh.shell_halves[shell], o, d)
            index, ab = shell_cell(shell, o + t * d, P)
            quad = mesh.shell_quads[index]
            if quad >= 0 and t > NEAR:
                alpha = alpha_of(surface, quad, ab, o + t * d)
                hits.quad[r, n] = quad
                hits.ab[r, n] = ab
                hits.t[r, n] = t
                hits.alpha[r, n] = alpha
                hits.transmittance[r, n] = T
                T *= 1.0 - alpha
                if alpha > 0.5:
                    opaque += 1
                n += 1
                lit = opaque < 2 or (binary_only == 0 and T >= OPAQUE)
            shell += 1
        hits.count[r] = n

    return trace
