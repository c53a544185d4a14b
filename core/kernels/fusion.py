"""Depth pictures of a voxel field, the signed distance they agree on (Curless and Levoy 1996), and what the field says
of a mesh's opacity."""

import warp as wp

from core.kernels.camera_rays import CameraArray
from core.kernels.march import Samples
from core.kernels.space import TAPER, Space, grid_velocity, to_cells, to_grid
from core.kernels.trace import Hits
from core.kernels.types import FAR, cell_of, corner_place, corner_weight, nodes_around

wp.set_module_options({"enable_backward": False})

# A surface is where half of a ray's light has ended.
MEDIAN = wp.constant(0.5)


@wp.struct
class DepthPictures:
    """Distances along the rays through pixel centres, of several cameras, one after the other."""

    cameras: CameraArray
    start: wp.array(dtype=wp.int32)  # [cameras], where a camera's pixels begin
    size: wp.array(dtype=wp.vec2i)  # [cameras], width and height
    depth: wp.array(dtype=float)  # rows from the top; FAR where there is no surface


@wp.kernel
def median_depth(first: int, samples: Samples, step: float, depth: wp.array(dtype=float)):
    """Where along each ray half of its light has ended; FAR where more than half of it passes everything.

    A sample stands for half a step before it and half a step behind.
    """
    r = first + wp.tid()
    ended = float(0.0)
    found = float(FAR)
    for n in range(wp.min(samples.count[r], samples.t.shape[1])):
        w = samples.transmittance[r, n] * samples.alpha[r, n]
        if ended < MEDIAN and ended + w >= MEDIAN:
            found = samples.t[r, n] + ((MEDIAN - ended) / w - 0.5) * step
        ended += w
    depth[r] = found


@wp.func
def speed_in_cells(space: Space, p: wp.vec3, d: wp.vec3):
    """How fast a point's place among the mesh's cells moves as it moves along d."""
    if space.kind == TAPER:
        return wp.length(grid_velocity(space, p, d))
    return 1.0


@wp.func
def depth_at(pictures: DepthPictures, camera: int, x: float, y: float, same: float):
    """The depth at a place (in pixels, 0 at the first centre): bilinear on one surface, else that of the nearest pixel.

    Depths that differ by more than `same` are of different surfaces.
    """
    size = pictures.size[camera]
    x = wp.clamp(x, 0.0, float(size[0] - 1))
    y = wp.clamp(y, 0.0, float(size[1] - 1))
    column = wp.min(int(x), wp.max(size[0] - 2, 0))
    row = wp.min(int(y), wp.max(size[1] - 2, 0))
    right = wp.min(column + 1, size[0] - 1)
    below = wp.min(row + 1, size[1] - 1)
    start = pictures.start[camera]
    a = pictures.depth[start + row * size[0] + column]
    b = pictures.depth[start + row * size[0] + right]
    c = pictures.depth[start + below * size[0] + column]
    d = pictures.depth[start + below * size[0] + right]
    fx = x - float(column)
    fy = y - float(row)
    if wp.max(wp.max(a, b), wp.max(c, d)) - wp.min(wp.min(a, b), wp.min(c, d)) < same:
        return (a * (1.0 - fx) + b * fx) * (1.0 - fy) + (c * (1.0 - fx) + d * fx) * fy
    upper = wp.where(fx < 0.5, a, b)
    lower = wp.where(fx < 0.5, c, d)
    return wp.where(fy < 0.5, upper, lower)


@wp.kernel
def fuse_depths(
    first: int,
    space: Space,
    pictures: DepthPictures,
    points: wp.array(dtype=wp.vec3),  # scene points
    band: float,  # in the cells' cube
    hidden: float,  # in bands
    distance: wp.array(dtype=float),  # mean of what the pictures say, in bands [-1, 1]; positive before surfaces
    weight: wp.array(dtype=float),  # how many pictures say something
):
    """Each picture says how far before or behind its surface a point lies, cut off at one band either way; of what lies
    more than `hidden` bands behind it knows nothing."""
    i = first + wp.tid()
    p = points[i]
    total = float(0.0)
    n = float(0.0)
    for c in range(pictures.start.shape[0]):
        ray = p - pictures.cameras.position[c]
        q = wp.transpose(pictures.cameras.rotation[c]) * ray
        t = wp.length(ray)
        if q[2] < -1.0e-6 * t:  # else it lies beside or behind the camera
            x = pictures.cameras.centre_px[c][0] - pictures.cameras.focal_px[c][0] * q[0] / q[2] - 0.5
            y = pictures.cameras.centre_px[c][1] + pictures.cameras.focal_px[c][1] * q[1] / q[2] - 0.5
            size = pictures.size[c]
            if x >= -0.5 and y >= -0.5 and x < float(size[0]) - 0.5 and y < float(size[1]) - 0.5:
                scale = speed_in_cells(space, p, ray / t) / band
                d = (depth_at(pictures, c, x, y, hidden / scale) - t) * scale
                if d > -hidden:
                    total += wp.clamp(d, -1.0, 1.0)
                    n += 1.0
    distance[i] = total / wp.max(n, 1.0)
    weight[i] = n


@wp.func
def cells_apart(space: Space, o: wp.vec3, d: wp.vec3, near: float, far: float):
    """How far apart two places of a ray are in the mesh's cells' cube; FAR if one of them is nowhere."""
    if wp.max(near, far) >= FAR:
        return float(FAR)
    return wp.length(to_cells(space, o + near * d) - to_cells(space, o + far * d))


@wp.kernel
def compare_depths(
    first: int,
    space: Space,
    cells: int,
    origins: wp.array(dtype=wp.vec3),
    directions: wp.array(dtype=wp.vec3),
    depth: wp.array(dtype=float),  # where each ray ends, or FAR
    other: wp.array(dtype=float),
    apart: wp.array(dtype=float),  # of the two, in the cells' cube
    cell: wp.array(dtype=wp.int32),  # flat index of the cell it ends in, -1 where none
):
    r = first + wp.tid()
    apart[r] = cells_apart(space, origins[r], directions[r], depth[r], other[r])
    cell[r] = -1
    if depth[r] < FAR:
        g = to_cells(space, origins[r] + depth[r] * directions[r])
        if wp.max(wp.abs(g)) < 1.0:
            cell[r] = cell_of(g, cells)


@wp.kernel
def vote_opacity(
    first: int,
    space: Space,
    nodes: int,  # per axis
    row_of: wp.array(dtype=wp.int32),  # [places], or -1
    origins: wp.array(dtype=wp.vec3),
    directions: wp.array(dtype=wp.vec3),
    depth: wp.array(dtype=float),  # [rays], where the field has its surface, or FAR
    tolerance: float,  # in the cells' cube
    hits: Hits,  # all of the mesh's, as if everything were clear
    part: int,
    solid: wp.array2d(dtype=float),  # [parts, rows]
    clear: wp.array2d(dtype=float),
):
    """Hits near the surface that a ray ends at speak for opacity there, hits before it against; what lies behind is not
    known."""
    r = first + wp.tid()
    for k in range(hits.count[r]):
        t = hits.t[r, k]
        apart = cells_apart(space, origins[r], directions[r], t, depth[r])
        p = origins[r] + t * directions[r]
        among_cells = wp.max(wp.abs(to_cells(space, p))) <= 1.0  # shells around them are too far apart to tell
        if among_cells and (t <= depth[r] or apart <= tolerance):
            low, high, f = nodes_around(to_grid(space, p), nodes)
            for c in range(8):
                row = row_of[corner_place(c, low, high)]
                if row >= 0:
                    if apart <= tolerance:
                        wp.atomic_add(solid, part, row, corner_weight(c, f))
                    else:
                        wp.atomic_add(clear, part, row, corner_weight(c, f))
