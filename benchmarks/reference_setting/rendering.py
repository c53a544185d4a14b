"""Colours of rays from their quadrature points: continuous, and with binary opacity (eq. 2, 12, 15 to 17)."""

from dataclasses import dataclass

import torch
from torch import Tensor

from benchmarks.reference_setting.networks import PaperNetworks
from benchmarks.reference_setting.quadrature import Hits

LEAST_COVERAGE = 1e-4  # below it a mean over the covered part says nothing


@dataclass(frozen=True)
class Points:
    """Quadrature points in rows, one a ray; places without a point have opacity 0.

    Attributes:
        alpha: [R, n], features: [R, n, 8].
        hits: what the places were filled from.
    """

    alpha: Tensor
    features: Tensor
    hits: Hits

    @property
    def binary_alpha(self) -> Tensor:
        """0 or 1; gradients go straight through (eq. 12)."""
        return self.alpha + ((self.alpha > 0.5).to(self.alpha.dtype) - self.alpha).detach()


def points_of(networks: PaperNetworks, positions: Tensor, hits: Hits, rays: int) -> Points:
    """The networks at every hit."""
    n = int(hits.rank.max()) + 1 if len(hits.rank) else 1
    alpha = torch.zeros(rays, n, device=positions.device)
    features = torch.zeros(rays, n, 8, device=positions.device)
    place = (hits.ray, hits.rank)
    alpha = alpha.index_put(place, networks.opacity(positions))
    return Points(alpha, features.index_put(place, networks.features(positions)), hits)


def visibility(alpha: Tensor) -> Tensor:
    """T_k alpha_k [R, n] of opacities sorted front to back (eq. 2)."""
    left = torch.cat([torch.ones_like(alpha[:, :1]), (1.0 - alpha[:, :-1]).cumprod(1)], 1)
    return left * alpha


def color_per_point(
    networks: PaperNetworks, points: Points, weight: Tensor, directions: Tensor
) -> tuple[Tensor, Tensor]:
    """(colour times coverage [R, 3], coverage [R]): the network runs at each point (stage 1, eq. 2)."""
    ray, rank = points.hits.ray, points.hits.rank
    colors = networks.color(points.features[ray, rank], directions[ray])
    total = torch.zeros(len(weight), 3, device=weight.device).index_add(0, ray, weight[ray, rank, None] * colors)
    return total, weight.sum(1)


def color_per_pixel(
    networks: PaperNetworks, points: Points, weight: Tensor, directions: Tensor, subrays: int
) -> tuple[Tensor, Tensor]:
    """(colour times coverage [R, 3], coverage [R]): the network runs once, on averaged features (eq. 16 and 17)."""
    F = (weight[..., None] * points.features).sum(1).reshape(-1, subrays, 8).mean(1)
    coverage = weight.sum(1).reshape(-1, subrays).mean(1)
    mean = F / coverage.clamp_min(LEAST_COVERAGE)[:, None]
    return networks.color(mean, directions) * coverage[:, None], coverage
