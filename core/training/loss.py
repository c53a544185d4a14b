"""What training minimises."""

import numpy as np
import torch
from torch import Tensor


def pixel_loss(color: Tensor, coverage: Tensor, true_color: Tensor, true_alpha: Tensor, weight: float) -> Tensor:
    """Mean squared error of the picture over the background (eq. 1), and of coverage.

    A photo over one background colour cannot tell the object from the background where both look alike; with an alpha
    channel it can. Over a background b the error is (dC - dA b): its mean over black and white is dC^2 - dC dA + dA^2 / 2.

    Args:
        color, true_color: [n, 3], times coverage or alpha.
        coverage, true_alpha: [n].
        weight: of the coverage's own error, on top.
    """
    d_color = color - true_color
    d_alpha = (coverage - true_alpha)[:, None]
    over_white = ((d_color - d_alpha) ** 2).mean()
    return over_white + weight * (d_alpha**2).mean()


def psnr_of(errors: list[float]) -> float:
    """PSNR (dB) of the mean of squared errors; at most 100."""
    return float(-10.0 * np.log10(max(float(np.mean(errors)), 1e-10))) if errors else 0.0


def color_error(color: Tensor, coverage: Tensor, batch_color: Tensor, batch_alpha: Tensor) -> float:
    """Mean squared error over white, for reporting."""
    with torch.no_grad():
        return float(((color - batch_color - (coverage - batch_alpha)[:, None]) ** 2).mean())
