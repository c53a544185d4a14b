"""The two surfaces that a traced mesh can wear: a volume sampled where rays hit (field stage), and its texels."""

import warp as wp

from core.kernels.composite import backward_kernel, composite_kernel
from core.kernels.space import Space, grid_velocity, to_grid
from core.kernels.trace import QuadMesh, corner_weights, trace_kernel
from core.kernels.types import corner_place, corner_weight, nodes_around, vec8

wp.set_module_options({"enable_backward": False, "fast_math": True})

# Seen at a flatter angle than this (cosine), a quad's vertices get no gradient: dt/dv grows without bound.
GRAZING = wp.constant(0.1)


@wp.struct
class Volume:
    """Opacity and features [places] on a grid of nodes in brick order (core/field/bricks.py), trilinear in between."""

    space: Space
    nodes: int
    alpha: wp.array(dtype=float)
    features: wp.array(dtype=vec8)


@wp.struct
class VolumeGradients:
    row_of: wp.array(dtype=wp.int32)  # [places], where a node's gradient goes, or -1
    alpha: wp.array2d(dtype=float)  # [parts, rows]
    features: wp.array2d(dtype=vec8)
    touched: wp.array(dtype=wp.uint8)
    vertices: wp.array2d(dtype=wp.vec3)  # [parts, vertices]


@wp.struct
class Texels:
    """K x K texels a quad, nearest lookup; texel (i, j) of quad q is entry (q K + i) K + j, i along a, j along b."""

    K: int
    alpha: wp.array(dtype=float)
    features: wp.array(dtype=vec8)


@wp.struct
class TexelGradients:
    alpha: wp.array2d(dtype=float)  # [parts, texels]
    features: wp.array2d(dtype=vec8)
    stamp: wp.array2d(dtype=wp.int32)  # [parts, texels], the last batch that touched it
    touched: wp.array2d(dtype=wp.int32)  # [parts, capacity], this batch's texels
    touched_count: wp.array(dtype=wp.int32)  # [parts]
    batch: int
    with_alpha: int


@wp.func
def volume_alpha(volume: Volume, quad: int, ab: wp.vec2, p: wp.vec3):
    low, high, f = nodes_around(to_grid(volume.space, p), volume.nodes)
    alpha = float(0.0)
    for c in range(8):
        alpha += corner_weight(c, f) * volume.alpha[corner_place(c, low, high)]
    return alpha


@wp.func
def volume_features(volume: Volume, quad: int, ab: wp.vec2, p: wp.vec3):
    low, high, f = nodes_around(to_grid(volume.space, p), volume.nodes)
    features = vec8()
    for c in range(8):
        features += corner_weight(c, f) * volume.features[corner_place(c, low, high)]
    return features


@wp.func
def volume_scatter(
    mesh: QuadMesh,
    volume: Volume,
    gradients: VolumeGradients,
    part: int,
    quad: int,
    ab: wp.vec2,
    o: wp.vec3,
    d: wp.vec3,
    t: float,
    grad_alpha: float,
    grad_features: vec8,
):
    p = o + t * d
    low, high, f = nodes_around(to_grid(volume.space, p), volume.nodes)
    slope = wp.vec3()  # dL/d(grid point), in node spacings
    for c in range(8):
        node = corner_place(c, low, high)
        weight = corner_weight(c, f)
        row = gradients.row_of[node]
        if row >= 0:
            wp.atomic_add(gradients.alpha, part, row, weight * grad_alpha)
            wp.atomic_add(gradients.features, part, row, weight * grad_features)
            gradients.touched[row] = wp.uint8(1)
        value = grad_alpha * volume.alpha[node] + wp.dot(grad_features, volume.features[node])
        wx = wp.where((c & 4) != 0, f[0], 1.0 - f[0])
        wy = wp.where((c & 2) != 0, f[1], 1.0 - f[1])
        wz = wp.where((c & 1) != 0, f[2], 1.0 - f[2])
        slope += value * wp.vec3(
            wp.where((c & 4) != 0, wy * wz, -wy * wz),
            wp.where((c & 2) != 0, wx * wz, -wx * wz),
            wp.where((c & 1) != 0, wx * wy, -wx * wy),
        )
    # The hit moves along the ray as its triangle moves: dt/dv_i = weight_i n / (n . d).
    q = mesh.quads[quad]
    if q[0] >= mesh.movable:
        return
    middle = wp.where(ab[1] >= ab[0], q[1], q[2])
    v0 = mesh.vertices[q[0]]
    n = wp.normalize(wp.cross(mesh.vertices[middle] - v0, mesh.vertices[q[3]] - v0))
    facing = wp.dot(n, d)
    if wp.abs(facing) > GRAZING:
        velocity = grid_velocity(volume.space, p, d)
        along = wp.dot(slope, velocity) * float(volume.nodes - 1) * 0.5 / facing
        weights = corner_weights(ab)
        wp.atomic_add(gradients.vertices, part, q[0], (weights[0] * along) * n)
        wp.atomic_add(gradients.vertices, part, middle, ((weights[1] + weights[2]) * along) * n)
        wp.atomic_add(gradients.vertices, part, q[3], (weights[3] * along) * n)


@wp.func
def texel_index(K: int, quad: int, ab: wp.vec2):
    """The nearest texel: corners lie on the centres of the corner texels."""
    i = int(ab[0] * float(K - 1) + 0.5)
    j = int(ab[1] * float(K - 1) + 0.5)
    return (quad * K + wp.clamp(i, 0, K - 1)) * K + wp.clamp(j, 0, K - 1)


@wp.func
def texel_alpha(texels: Texels, quad: int, ab: wp.vec2, p: wp.vec3):
    return texels.alpha[texel_index(texels.K, quad, ab)]


@wp.func
def texel_features(texels: Texels, quad: int, ab: wp.vec2, p: wp.vec3):
    return texels.features[texel_index(texels.K, quad, ab)]


@wp.func
def texel_scatter(
    mesh: QuadMesh,
    texels: Texels,
    gradients: TexelGradients,
    part: int,
    quad: int,
    ab: wp.vec2,
    o: wp.vec3,
    d: wp.vec3,
    t: float,
    grad_alpha: float,
    grad_features: vec8,
):
    i = texel_index(texels.K, quad, ab)
    if wp.atomic_max(gradients.stamp, part, i, gradients.batch) != gradients.batch:
        slot = wp.atomic_add(gradients.touched_count, part, 1)
        gradients.touched[part, slot] = i
    wp.atomic_add(gradients.features, part, i, grad_features)
    if gradients.with_alpha == 1:
        wp.atomic_add(gradients.alpha, part, i, grad_alpha)


@wp.kernel
def sample_volume(
    first: int,
    volume: Volume,
    points: wp.array(dtype=wp.vec3),
    alpha: wp.array(dtype=float),
    features: wp.array(dtype=vec8),
):
    """Opacity and features at points of the cube."""
    i = first + wp.tid()
    alpha[i] = volume_alpha(volume, 0, wp.vec2(), points[i])
    features[i] = volume_features(volume, 0, wp.vec2(), points[i])


VOLUME_KERNELS = (
    trace_kernel(volume_alpha, Volume),
    composite_kernel(volume_features, Volume),
    backward_kernel(volume_scatter, Volume, VolumeGradients),
)
TEXEL_KERNELS = (
    trace_kernel(texel_alpha, Texels),
    composite_kernel(texel_features, Texels),
    backward_kernel(texel_scatter, Texels, TexelGradients),
)
