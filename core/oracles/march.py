"""Volume rendering of one ray by the book (eq. 2), and the distortion loss of mip-NeRF 360 (eq. 15) in O(n^2)."""

from dataclasses import dataclass

import torch
from torch import Tensor

from core.oracles.grid import trilinear


@dataclass(frozen=True)
class March:
    """How to march.

    Attributes:
        step: distance between samples, cube units.
        density_scale: opacity is 1 - exp(-relu(raw) * density_scale * step).
        leak: samples whose raw density is at most this do not exist; those from here to 0 are transparent, but get the
            gradient of one just above 0.
        opaque: a ray ends once less light than this is left.
        half: samples lie within the cube [-half, half]^3.
        near: nothing nearer than this is sampled.
    """

    step: float
    density_scale: float
    leak: float
    opaque: float
    half: float = 0.9999
    near: float = 1e-3


@dataclass(frozen=True)
class Ray:
    """A rendered ray: features F [8] times opacity, opacity A, and its samples' weights w [k] and distances t [k]."""

    F: Tensor
    A: Tensor
    w: Tensor
    t: Tensor


def span(origin: Tensor, direction: Tensor, half: float, near: float) -> tuple[float, float]:
    """(entry, exit) of a ray in the cube [-half, half]^3; entry >= exit where it misses."""
    entry, leave = near, float("inf")
    for o, d in zip(origin.tolist(), direction.tolist(), strict=True):
        if d == 0.0:
            if abs(o) > half:
                return 1.0, 0.0
            continue
        sides = sorted(((-half - o) / d, (half - o) / d))
        entry, leave = max(entry, sides[0]), min(leave, sides[1])
    return entry, leave


def render(how: March, density: Tensor, features: Tensor, origin: Tensor, direction: Tensor, jitter: float) -> Ray:
    """Args: density: raw, [n, n, n]. features: [n, n, n, 8]. jitter: of the first sample, in steps."""
    entry, leave = span(origin, direction, how.half, how.near)
    count = max(0, int((leave - entry) / how.step - jitter) + 2)
    t = entry + how.step * (jitter + torch.arange(count, dtype=torch.float64))
    t = t[t < leave]
    raw = trilinear(density[..., None], origin + t[:, None] * direction)[:, 0]
    t, raw = t[raw.detach() > how.leak], raw[raw.detach() > how.leak]
    matter = raw + (raw.clamp_min(0.0) - raw).detach()  # the value of a ReLU, the gradient of the identity
    alpha = 1.0 - torch.exp(-matter * (how.density_scale * how.step))
    left = torch.cumprod(1.0 - alpha, 0)
    T = torch.cat([torch.ones(1, dtype=torch.float64), left])[:-1]
    reached = T.detach() >= how.opaque
    w, t = (T * alpha)[reached], t[reached]
    f = trilinear(features, origin + t[:, None] * direction)
    return Ray((w[:, None] * f).sum(0), w.sum(), w, t)


def distortion(w: Tensor, t: Tensor, step: float) -> Tensor:
    """sum_ij w_i w_j |t_i - t_j| + sum_i w_i^2 step / 3."""
    apart = (t[:, None] - t[None, :]).abs()
    return (w[:, None] * w[None, :] * apart).sum() + (w**2).sum() * step / 3.0
