"""Warp kernels of the rasteriser: a visibility buffer, then shading. Compare reference.py, which is the same in NumPy.

Frames and symbols: vertices are in the camera frame (float64, the camera at the origin), so neither the scene's scale
nor its distance from the frame's origin costs precision. A ray through a sample is d = (x, y, -1), so that t is the
depth. `b0, b1, b2` are a triangle's edge functions at d, proportional to the barycentric coordinates.

The buffer holds one key per sample: depth, quantised linearly over the scene's depth range, in the upper 32 bits, and
the triangle in the lower. Its minimum is the nearest triangle, the first of equally near ones.

Texels of all pages lie in one array, page after page, row by row, a texel's 8 bytes in one integer (channel 0 lowest).
"""

import warp as wp

wp.set_module_options({"enable_backward": False})

EMPTY = wp.constant(wp.uint64(0xFFFFFFFFFFFFFFFF))  # a key behind everything
DEPTH_STEPS = wp.constant(wp.float64(4294967294.0))  # the deepest key still lies before EMPTY

vec16 = wp.types.vector(length=16, dtype=wp.float32)
vec8 = wp.types.vector(length=8, dtype=wp.float32)


@wp.struct
class Lens:
    """The sample grid: a camera whose pixels are the samples."""

    focal: wp.vec2d
    centre: wp.vec2d
    width: int
    height: int
    nearest: wp.float64  # depth range of the scene's vertices
    depth_scale: wp.float64  # DEPTH_STEPS / length of that range


@wp.struct
class Surface:
    """A scene's triangles and texels."""

    vertices: wp.array(dtype=wp.vec3d)  # camera frame
    triangles: wp.array(dtype=wp.vec3i)  # into vertices and texcoords
    texcoords: wp.array(dtype=wp.vec2f)
    triangle_page: wp.array(dtype=int)
    page_size: wp.array(dtype=wp.vec2i)  # width, height
    page_first: wp.array(dtype=int)  # its first texel
    texels: wp.array(dtype=wp.uint64)


@wp.struct
class Hit:
    """Where a ray meets a triangle's texture."""

    depth: wp.float64  # not positive: missed
    texel: int  # among all pages; -1: missed


@wp.kernel
def to_camera_frame(
    first: int,
    positions: wp.array(dtype=wp.vec3d),
    eye: wp.vec3d,
    camera_from_world: wp.mat33d,
    vertices: wp.array(dtype=wp.vec3d),
):
    i = first + wp.tid()
    vertices[i] = camera_from_world * (positions[i] - eye)


@wp.func
def sample_ray(lens: Lens, column: int, row: int) -> wp.vec3d:
    half = wp.float64(0.5)
    x = (wp.float64(column) + half - lens.centre[0]) / lens.focal[0]
    y = (wp.float64(row) + half - lens.centre[1]) / lens.focal[1]
    return wp.vec3d(x, -y, wp.float64(-1.0))


@wp.func
def texel_at(surface: Surface, triangle: int, texcoord: wp.vec2d) -> int:
    """The nearest texel, floor(texcoord * size), within the triangle's page."""
    page = surface.triangle_page[triangle]
    size = surface.page_size[page]
    column = wp.clamp(int(wp.floor(texcoord[0] * wp.float64(size[0]))), 0, size[0] - 1)
    row = wp.clamp(int(wp.floor(texcoord[1] * wp.float64(size[1]))), 0, size[1] - 1)
    return surface.page_first[page] + row * size[0] + column


@wp.func
def intersect(surface: Surface, triangle: int, ray: wp.vec3d) -> Hit:
    """The homogeneous ray-triangle test of reference.py."""
    hit = Hit()
    hit.depth = wp.float64(-1.0)
    hit.texel = -1
    zero = wp.float64(0.0)
    index = surface.triangles[triangle]
    v0 = surface.vertices[index[0]]
    v1 = surface.vertices[index[1]]
    v2 = surface.vertices[index[2]]
    n0 = wp.cross(v1, v2)
    b0 = wp.dot(ray, n0)
    b1 = wp.dot(ray, wp.cross(v2, v0))
    b2 = wp.dot(ray, wp.cross(v0, v1))
    total = b0 + b1 + b2
    inside = (b0 >= zero and b1 >= zero and b2 >= zero) or (b0 <= zero and b1 <= zero and b2 <= zero)
    if inside and total != zero:
        hit.depth = wp.dot(v0, n0) / total
        if hit.depth > zero:
            uv0 = surface.texcoords[index[0]]
            uv1 = surface.texcoords[index[1]]
            uv2 = surface.texcoords[index[2]]
            u = (b0 * wp.float64(uv0[0]) + b1 * wp.float64(uv1[0]) + b2 * wp.float64(uv2[0])) / total
            v = (b0 * wp.float64(uv0[1]) + b1 * wp.float64(uv1[1]) + b2 * wp.float64(uv2[1])) / total
            hit.texel = texel_at(surface, triangle, wp.vec2d(u, v))
    return hit


@wp.func
def include(box: wp.vec4d, axis: int, value: wp.float64) -> wp.vec4d:
    """The box (low x, low y, high x, high y) grown to contain `value` along an axis."""
    grown = box
    if axis == 0:
        grown[0] = wp.min(box[0], value)
        grown[2] = wp.max(box[2], value)
    else:
        grown[1] = wp.min(box[1], value)
        grown[3] = wp.max(box[3], value)
    return grown


@wp.func
def include_edge(box: wp.vec4d, start: wp.vec3d, end: wp.vec3d) -> wp.vec4d:
    """Grows the box (of x / depth, y / depth) by the part of an edge that is in front of the camera.

    Where the edge crosses the camera's plane, its projection runs to infinity in the direction of the crossing point.
    """
    grown = box
    zero = wp.float64(0.0)
    far = wp.float64(1.0e30)
    if start[2] < zero:
        grown = include(grown, 0, -start[0] / start[2])
        grown = include(grown, 1, -start[1] / start[2])
    if (start[2] < zero) != (end[2] < zero):
        for axis in range(2):
            # The crossing point times (end.z - start.z); only its sign matters.
            crossing = start[axis] * end[2] - end[axis] * start[2]
            if start[2] > end[2]:
                crossing = -crossing
            if crossing >= zero:
                grown = include(grown, axis, far)
            if crossing <= zero:
                grown = include(grown, axis, -far)
    return grown


@wp.kernel
def find_boxes(first: int, surface: Surface, lens: Lens, boxes: wp.array(dtype=wp.vec4i)):
    """Per triangle the samples that it may cover: first column, first row, one past the last column and row."""
    i = first + wp.tid()
    index = surface.triangles[i]
    v0 = surface.vertices[index[0]]
    v1 = surface.vertices[index[1]]
    v2 = surface.vertices[index[2]]
    far = wp.float64(2.0e30)
    box = wp.vec4d(far, far, -far, -far)
    box = include_edge(box, v0, v1)
    box = include_edge(box, v1, v2)
    box = include_edge(box, v2, v0)
    # y points down in the image. The margin of one sample keeps rounding out of the question.
    one = wp.float64(1.0)
    boxes[i] = wp.vec4i(
        clamped(wp.floor(lens.centre[0] + lens.focal[0] * box[0]) - one, lens.width),
        clamped(wp.floor(lens.centre[1] - lens.focal[1] * box[3]) - one, lens.height),
        clamped(wp.ceil(lens.centre[0] + lens.focal[0] * box[2]) + one, lens.width),
        clamped(wp.ceil(lens.centre[1] - lens.focal[1] * box[1]) + one, lens.height),
    )


@wp.func
def clamped(value: wp.float64, size: int) -> int:
    return int(wp.clamp(value, wp.float64(0.0), wp.float64(size)))


@wp.kernel
def draw(
    first: int,
    surface: Surface,
    lens: Lens,
    boxes: wp.array(dtype=wp.vec4i),
    first_row: int,
    rows: int,
    bands: int,
    keys: wp.array(dtype=wp.uint64),
):
    """Index = band * triangles + triangle. On the CPU, where atomics are none, a band of rows is one thread's own."""
    i = first + wp.tid()
    count = surface.triangles.shape[0]
    band = i / count
    triangle = i - band * count
    box = boxes[triangle]
    top = wp.max(box[1], first_row + rows * band / bands)
    bottom = wp.min(box[3], first_row + rows * (band + 1) / bands)
    for row in range(top, bottom):
        for column in range(box[0], box[2]):
            hit = intersect(surface, triangle, sample_ray(lens, column, row))
            if hit.texel >= 0 and is_opaque(surface.texels[hit.texel]):
                sample = (row - first_row) * lens.width + column
                wp.atomic_min(keys, sample, key_of(lens, hit.depth, triangle))


@wp.func
def is_opaque(texel: wp.uint64) -> bool:
    return (texel & wp.uint64(255)) != wp.uint64(0)


@wp.func
def key_of(lens: Lens, depth: wp.float64, triangle: int) -> wp.uint64:
    step = wp.clamp((depth - lens.nearest) * lens.depth_scale, wp.float64(0.0), DEPTH_STEPS)
    return (wp.uint64(step) << wp.uint64(32)) | wp.uint64(triangle)


@wp.func
def triangle_of(key: wp.uint64) -> int:
    """The nearest triangle; -1 where nothing was drawn."""
    if key == EMPTY:
        return -1
    return int(key & wp.uint64(0xFFFFFFFF))


@wp.kernel
def resolve(
    first: int,
    surface: Surface,
    lens: Lens,
    first_row: int,
    keys: wp.array(dtype=wp.uint64),
    triangles: wp.array(dtype=int),
    texels: wp.array(dtype=int),
):
    """Per sample the triangle and the texel seen, or -1."""
    i = first + wp.tid()
    triangle = triangle_of(keys[i])
    texel = int(-1)
    if triangle >= 0:
        hit = intersect(surface, triangle, sample_ray(lens, i % lens.width, first_row + i / lens.width))
        texel = hit.texel
    triangles[i] = triangle
    texels[i] = texel


@wp.func
def dense(x: vec16, weights: wp.array(dtype=float), offset: int, rows: int, columns: int) -> vec16:
    """A layer, from weights [columns, rows] and then biases [rows] at `offset`."""
    y = vec16()
    for row in range(rows):
        y[row] = weights[offset + rows * columns + row]
    for column in range(columns):
        for row in range(rows):
            y[row] += weights[offset + column * rows + row] * x[column]
    return y


@wp.func
def rectified(x: vec16) -> vec16:
    y = vec16()
    for row in range(16):
        y[row] = wp.max(x[row], 0.0)
    return y


@wp.func
def network(features: vec8, direction: wp.vec3f, weights: wp.array(dtype=float)) -> wp.vec3f:
    x = vec16()
    for channel in range(8):
        x[channel] = features[channel]
    for axis in range(3):
        x[8 + axis] = direction[axis]
    x = rectified(dense(x, weights, 0, 16, 11))
    x = rectified(dense(x, weights, 192, 16, 16))
    x = dense(x, weights, 464, 3, 16)
    color = wp.vec3f()
    for channel in range(3):
        color[channel] = 0.5 + 0.5 * wp.tanh(0.5 * x[channel])
    return color


@wp.kernel
def shade(
    first: int,
    surface: Surface,
    lens: Lens,
    first_row: int,
    side: int,
    keys: wp.array(dtype=wp.uint64),
    world_from_camera: wp.mat33d,
    weights: wp.array(dtype=float),
    image: wp.array(dtype=wp.vec4f),
):
    """Per pixel of side x side samples: the mean of the covered samples' features, and the network once."""
    i = first + wp.tid()
    width = lens.width / side
    row = i / width
    column = i - row * width
    total = vec8()
    covered = float(0.0)
    for sample in range(side * side):
        x = column * side + sample % side
        y = row * side + sample / side
        triangle = triangle_of(keys[y * lens.width + x])
        if triangle >= 0:
            hit = intersect(surface, triangle, sample_ray(lens, x, first_row + y))
            if hit.texel >= 0:  # it was when drawn; the compiler may have fused the arithmetic differently there
                texel = surface.texels[hit.texel]
                for channel in range(8):
                    total[channel] += float((texel >> wp.uint64(8 * channel)) & wp.uint64(255)) / 255.0
                covered += 1.0
    pixel = wp.vec4f()
    if covered > 0.0:
        direction = wp.normalize(world_from_camera * pixel_ray(lens, side, column, first_row / side + row))
        color = network(total / covered, wp.vec3f(direction), weights)
        coverage = covered / float(side * side)
        pixel = wp.vec4f(color[0] * coverage, color[1] * coverage, color[2] * coverage, coverage)
    image[i] = pixel


@wp.func
def pixel_ray(lens: Lens, side: int, column: int, row: int) -> wp.vec3d:
    """Through the centre of a pixel of side x side samples."""
    half = wp.float64(0.5)
    x = ((wp.float64(column) + half) * wp.float64(side) - lens.centre[0]) / lens.focal[0]
    y = ((wp.float64(row) + half) * wp.float64(side) - lens.centre[1]) / lens.focal[1]
    return wp.vec3d(x, -y, wp.float64(-1.0))
