"""Compositing one ray's hits, front to back: alpha [k], features [k, 8]. Both return (features [8], coverage)."""

import torch
from torch import Tensor


def continuous(alpha: Tensor, features: Tensor) -> tuple[Tensor, Tensor]:
    """Eq. 2: every hit is as opaque as its alpha says."""
    left = torch.cumprod(1.0 - alpha, 0)
    T = torch.cat([torch.ones(1, dtype=alpha.dtype), left])[: len(alpha)]
    w = T * alpha
    return (w[:, None] * features).sum(0), w.sum()


def binary(alpha: Tensor, features: Tensor) -> tuple[Tensor, Tensor]:
    """Eq. 12, 15: a hit is opaque if alpha > 0.5; its gradient passes straight through to alpha."""
    hard = (alpha > 0.5).to(alpha.dtype)
    return continuous(alpha + (hard - alpha).detach(), features)
