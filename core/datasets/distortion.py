"""The OpenCV lens model and its inverse.

Normalised image coordinates: x = (u - cx) / fx to the right, y = (v - cy) / fy downwards. With r² = x² + y²,

    x' = x (1 + k1 r² + k2 r⁴ + k3 r⁶ + k4 r⁸) + 2 p1 x y + p2 (r² + 2 x²)
    y' = y (1 + k1 r² + k2 r⁴ + k3 r⁶ + k4 r⁸) + 2 p2 x y + p1 (r² + 2 y²)

is where the lens shows what a pinhole would show at (x, y) (OpenCV's calib3d; k4 as nerfstudio reads it).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

NEWTON_STEPS = 30
# Newton converges quadratically to about 1e-16; what stays above this has no preimage near by.
CONVERGED = 1e-9


@dataclass(frozen=True)
class Distortion:
    """Coefficients of the OpenCV lens model (dimensionless); all zero is a pinhole."""

    k1: float = 0.0
    k2: float = 0.0
    k3: float = 0.0
    k4: float = 0.0
    p1: float = 0.0
    p2: float = 0.0

    @property
    def is_none(self) -> bool:
        return not any((self.k1, self.k2, self.k3, self.k4, self.p1, self.p2))

    def distort(self, points: np.ndarray) -> np.ndarray:
        """Where the lens shows pinhole points [..., 2] (normalised, float64)."""
        x, y = points[..., 0], points[..., 1]
        r2 = x * x + y * y
        radial = 1.0 + r2 * (self.k1 + r2 * (self.k2 + r2 * (self.k3 + r2 * self.k4)))
        return np.stack(
            [
                x * radial + 2.0 * self.p1 * x * y + self.p2 * (r2 + 2.0 * x * x),
                y * radial + 2.0 * self.p2 * x * y + self.p1 * (r2 + 2.0 * y * y),
            ],
            -1,
        )

    def jacobian(self, points: np.ndarray) -> np.ndarray:
        """Derivative [..., 2, 2] of `distort`: entry [i, j] is d out_i / d in_j."""
        x, y = points[..., 0], points[..., 1]
        r2 = x * x + y * y
        radial = 1.0 + r2 * (self.k1 + r2 * (self.k2 + r2 * (self.k3 + r2 * self.k4)))
        slope = self.k1 + r2 * (2.0 * self.k2 + r2 * (3.0 * self.k3 + r2 * 4.0 * self.k4))  # d radial / d r²
        xx = radial + 2.0 * x * x * slope + 2.0 * self.p1 * y + 6.0 * self.p2 * x
        xy = 2.0 * x * y * slope + 2.0 * self.p1 * x + 2.0 * self.p2 * y
        yy = radial + 2.0 * y * y * slope + 2.0 * self.p2 * x + 6.0 * self.p1 * y
        return np.stack([np.stack([xx, xy], -1), np.stack([xy, yy], -1)], -2)

    def undistort(self, points: np.ndarray) -> np.ndarray:
        """The pinhole points [..., 2] that the lens shows at `points`, by Newton's method; NaN where there is none."""
        pinhole = np.array(points, np.float64)
        with np.errstate(all="ignore"):
            for _ in range(NEWTON_STEPS):
                matrix, miss = self.jacobian(pinhole), points - self.distort(pinhole)
                (a, b), (c, d) = np.moveaxis(matrix, (-2, -1), (0, 1))
                step = np.stack([d * miss[..., 0] - b * miss[..., 1], a * miss[..., 1] - c * miss[..., 0]], -1)
                pinhole = pinhole + step / (a * d - b * c)[..., None]
            error = np.abs(self.distort(pinhole) - points).max(-1)
        return np.where((error < CONVERGED)[..., None], pinhole, np.nan)


NO_DISTORTION = Distortion()
