"""The gradient of silhouettes: how a pixel changes as an edge between two of its sub-rays moves.

Binary opacity makes a picture a step function of the mesh: where one sub-ray meets a surface and the next one passes
it, no derivative of either tells that the edge between them might move. But the edge's place between the two is as good
as even. If the nearer surface grows by e towards the other ray, which passes at a distance s, it takes that one over
with probability e / s. So with G, what the loss gains where the other ray shows the nearer surface, dL/de = G / s
(edge sampling: Li et al. 2018; here in expectation, without looking for the edge).

Half of the edges lie between two pixels' sub-rays instead of one's. Those within pixels stand for them, twofold.
"""

import warp as wp

from core.kernels.composite import PixelSums
from core.kernels.trace import Hits, QuadMesh, corner_weights
from core.kernels.types import FAR

wp.set_module_options({"enable_backward": False})


@wp.func
def first_opaque(hits: Hits, r: int):
    """The first opaque hit of a ray, or -1."""
    found = int(-1)
    for k in range(hits.count[r]):
        if found < 0 and hits.alpha[r, k] > 0.5:
            found = k
    return found


@wp.kernel
def silhouette_gradient(
    first: int,
    mesh: QuadMesh,
    origins: wp.array(dtype=wp.vec3),
    directions: wp.array(dtype=wp.vec3),
    hits: Hits,
    grad_binary: PixelSums,
    least_gap: float,  # between depths of different surfaces
    part: int,
    vertices: wp.array2d(dtype=wp.vec3),  # [parts, vertices], gradients
):
    """Four sub-rays a pixel, in rows of two."""
    i = first + wp.tid()
    gF = 0.25 * grad_binary.features[i]
    gA = 0.25 * grad_binary.alpha[i]
    for pair in range(4):
        a = 4 * i + wp.where(pair < 2, 2 * pair, pair - 2)
        b = a + wp.where(pair < 2, 1, 2)
        ka = first_opaque(hits, a)
        kb = first_opaque(hits, b)
        ta = float(FAR)
        tb = float(FAR)
        if ka >= 0:
            ta = hits.t[a, ka]
        if kb >= 0:
            tb = hits.t[b, kb]
        if wp.abs(ta - tb) > least_gap:
            near = wp.where(ta < tb, a, b)
            far = wp.where(ta < tb, b, a)
            k_near = wp.where(ta < tb, ka, kb)
            k_far = wp.where(ta < tb, kb, ka)
            gain = gA + wp.dot(gF, hits.features[near, k_near])
            if k_far >= 0:
                gain -= gA + wp.dot(gF, hits.features[far, k_far])
            t = hits.t[near, k_near]
            way = (directions[far] - directions[near]) * t + (origins[far] - origins[near])
            apart = wp.length_sq(way)
            q = mesh.quads[hits.quad[near, k_near]]
            if q[0] < mesh.movable and apart > 0.0:
                g = way * (2.0 * gain / apart)
                ab = hits.ab[near, k_near]
                weights = corner_weights(ab)
                middle = wp.where(ab[1] >= ab[0], q[1], q[2])
                wp.atomic_add(vertices, part, q[0], weights[0] * g)
                wp.atomic_add(vertices, part, middle, (weights[1] + weights[2]) * g)
                wp.atomic_add(vertices, part, q[3], weights[3] * g)
