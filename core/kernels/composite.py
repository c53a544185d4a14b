"""Compositing the hits of a pixel's sub-rays, continuous and binary, and the gradient by hand.

Continuous (eq. 2): F = mean over sub-rays of sum_k T_k a_k f_k, A alike with f = 1.
Binary (eq. 15): the first hit with a > 0.5 of each sub-ray, straight-through (eq. 12).

The gradient needs no division: with s_k = dL/dw_k and B_k what lies behind hit k, dL/da_k = T_k (s_k - B_k).
"""

from collections.abc import Callable
from functools import cache
from typing import Any

import warp as wp

from core.kernels.trace import OPTIONS, Hits, QuadMesh
from core.kernels.types import vec8

wp.set_module_options(OPTIONS)


@wp.struct
class PixelSums:
    """Means over a pixel's sub-rays; the binary ones and the continuous ones."""

    features: wp.array(dtype=vec8)  # [pixels], premultiplied by coverage
    alpha: wp.array(dtype=float)  # coverage


@cache
def composite_kernel(features_of: Callable[..., Any], surface_type: Any) -> wp.Kernel:
    """The kernel that composites hits whose features are `features_of(surface, quad, ab, point)`, and records them."""

    @wp.kernel(module="unique", module_options=OPTIONS)
    def composite(
        first: int,
        surface: surface_type,
        origins: wp.array(dtype=wp.vec3),
        directions: wp.array(dtype=wp.vec3),
        subrays: int,
        hits: Hits,
        continuous: PixelSums,
        binary: PixelSums,
    ):
        i = first + wp.tid()
        share = 1.0 / float(subrays)
        F = vec8()
        A = float(0.0)
        F_binary = vec8()
        A_binary = float(0.0)
        for s in range(subrays):
            r = i * subrays + s
            covered = float(0.0)
            for k in range(hits.count[r]):
                f = features_of(surface, hits.quad[r, k], hits.ab[r, k], origins[r] + hits.t[r, k] * directions[r])
                hits.features[r, k] = f
                w = hits.transmittance[r, k] * hits.alpha[r, k]
                F += w * f
                A += w
                if hits.alpha[r, k] > 0.5 and covered == 0.0:
                    covered = 1.0
                    F_binary += f
            A_binary += covered
        continuous.features[i] = share * F
        continuous.alpha[i] = share * A
        binary.features[i] = share * F_binary
        binary.alpha[i] = share * A_binary

    return composite


@cache
def backward_kernel(scatter: Callable[..., None], surface_type: Any, gradients_type: Any) -> wp.Kernel:
    """The kernel that hands dL/d(opacity, features) of each hit to
    `scatter(mesh, surface, gradients, part, quad, ab, origin, direction, t, grad_alpha, grad_features)`."""

    @wp.kernel(module="unique", module_options=OPTIONS)
    def backward(
        first: int,
        mesh: QuadMesh,
        surface: surface_type,
        origins: wp.array(dtype=wp.vec3),
        directions: wp.array(dtype=wp.vec3),
        subrays: int,
        hits: Hits,
        grad_continuous: PixelSums,
        grad_binary: PixelSums,
        part: int,
        gradients: gradients_type,
    ):
        i = first + wp.tid()
        share = 1.0 / float(subrays)
        gF = share * grad_continuous.features[i]
        gA = share * grad_continuous.alpha[i]
        gF_binary = share * grad_binary.features[i]
        gA_binary = share * grad_binary.alpha[i]
        for s in range(subrays):
            r = i * subrays + s
            count = hits.count[r]
            seen = int(count)  # the first opaque hit
            for k in range(count):
                if hits.alpha[r, k] > 0.5 and seen == count:
                    seen = k
            behind = float(0.0)
            behind_binary = float(0.0)
            for back in range(count):
                k = count - 1 - back
                alpha = hits.alpha[r, k]
                T = hits.transmittance[r, k]
                f = hits.features[r, k]
                here = gA + wp.dot(gF, f)
                here_binary = gA_binary + wp.dot(gF_binary, f)
                grad_alpha = T * (here - behind)
                grad_features = (T * alpha) * gF
                if k <= seen:
                    grad_alpha += here_binary - behind_binary
                if k == seen:
                    grad_features += gF_binary
                behind = alpha * here + (1.0 - alpha) * behind
                if alpha > 0.5:
                    behind_binary = here_binary
                scatter(
                    mesh, surface, gradients, part,
                    hits.quad[r, k], hits.ab[r, k], origins[r], directions[r], hits.t[r, k],
                    grad_alpha, grad_features,
                )  # fmt: skip

    return backward
