"""Lens models and their inverse: OpenCV's, rational and fisheye; COLMAP's and nerfstudio's are cases of them.

Normalised image coordinates: x = (u - cx) / fx to the right, y = (v - cy) / fy downwards. A fisheye lens first takes
the point of radius r = tan(theta) to the radius theta; other lenses leave it. Then, with r² = x² + y²,

    x' = x R + 2 p1 x y + p2 (r² + 2 x²) + s1 r²      R = 1 + k1 r² + k2 r⁴ + k3 r⁶ + k4 r⁸
    y' = y R + 2 p2 x y + p1 (r² + 2 y²) + s2 r²          ------------------------------
                                                           1 + d1 r² + d2 r⁴ + d3 r⁶

is where the lens shows what a pinhole would show (OpenCV's calib3d, where d1, d2, d3 are k4, k5, k6, and its fisheye
module; the thin prism s1, s2 as COLMAP's sx1, sy1; k4 as nerfstudio reads it).
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

NEWTON_STEPS = 30
# Newton converges quadratically to about 1e-16; what stays above this has no preimage near by.
CONVERGED = 1e-9
# Below this radius theta / r is its series: 1 - r²/3, exact to float64.
SMALL_RADIUS = 1e-4


@dataclass(frozen=True)
class Distortion:
    """Coefficients of the lens model (dimensionless), see above; all zero and not fisheye is a pinhole."""

    k1: float = 0.0
    k2: float = 0.0
    k3: float = 0.0
    k4: float = 0.0
    p1: float = 0.0
    p2: float = 0.0
    d1: float = 0.0
    d2: float = 0.0
    d3: float = 0.0
    s1: float = 0.0
    s2: float = 0.0
    fisheye: bool = False

    def __str__(self) -> str:
        stated = [f"{field.name}={getattr(self, field.name):g}" for field in fields(self) if getattr(self, field.name)]
        return f"({', '.join(stated)})"

    @property
    def is_none(self) -> bool:
        return not any(getattr(self, field.name) for field in fields(self))

    def distort(self, points: np.ndarray) -> np.ndarray:
        """Where the lens shows pinhole points [..., 2] (normalised, float64)."""
        if self.fisheye:
            points = _to_fisheye(points)
        x, y = points[..., 0], points[..., 1]
        r2 = x * x + y * y
        radial, _ = self._radial(r2)
        return np.stack(
            [
                x * radial + 2.0 * self.p1 * x * y + self.p2 * (r2 + 2.0 * x * x) + self.s1 * r2,
                y * radial + 2.0 * self.p2 * x * y + self.p1 * (r2 + 2.0 * y * y) + self.s2 * r2,
            ],
            -1,
        )

    def jacobian(self, points: np.ndarray) -> np.ndarray:
        """Derivative [..., 2, 2] of `distort`: entry [i, j] is d out_i / d in_j."""
        if self.fisheye:
            return self._jacobian(_to_fisheye(points)) @ _fisheye_jacobian(points)
        return self._jacobian(points)

    def _jacobian(self, points: np.ndarray) -> np.ndarray:
        x, y = points[..., 0], points[..., 1]
        radial, slope = self._radial(x * x + y * y)
        xx = radial + 2.0 * x * x * slope + 2.0 * self.p1 * y + 6.0 * self.p2 * x + 2.0 * self.s1 * x
        xy = 2.0 * x * y * slope + 2.0 * self.p1 * x + 2.0 * self.p2 * y
        yy = radial + 2.0 * y * y * slope + 2.0 * self.p2 * x + 6.0 * self.p1 * y + 2.0 * self.s2 * y
        rows = [np.stack([xx, xy + 2.0 * self.s1 * y], -1), np.stack([xy + 2.0 * self.s2 * x, yy], -1)]
        return np.stack(rows, -2)

    def _radial(self, r2: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """R above, and its derivative by r²."""
        above = 1.0 + r2 * (self.k1 + r2 * (self.k2 + r2 * (self.k3 + r2 * self.k4)))
        slope = self.k1 + r2 * (2.0 * self.k2 + r2 * (3.0 * self.k3 + r2 * 4.0 * self.k4))
        if not (self.d1 or self.d2 or self.d3):
            return above, slope
        below = 1.0 + r2 * (self.d1 + r2 * (self.d2 + r2 * self.d3))
        below_slope = self.d1 + r2 * (2.0 * self.d2 + r2 * 3.0 * self.d3)
        return above / below, (slope * below - above * below_slope) / (below * below)

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


def _to_fisheye(points: np.ndarray) -> np.ndarray:
    """Points [..., 2] of radius tan(theta), moved to the radius theta."""
    r = np.hypot(points[..., 0], points[..., 1])
    return points * _theta_over_r(r)[..., None]


def _fisheye_jacobian(points: np.ndarray) -> np.ndarray:
    r = np.hypot(points[..., 0], points[..., 1])
    ratio = _theta_over_r(r)
    # d(theta / r) / dr / r; its limit at r = 0 is -2/3.
    safe = np.maximum(r, SMALL_RADIUS)
    bend = np.where(r < SMALL_RADIUS, -2.0 / 3.0, (1.0 / (1.0 + safe * safe) - ratio) / (safe * safe))
    return ratio[..., None, None] * np.eye(2) + bend[..., None, None] * points[..., :, None] * points[..., None, :]


def _theta_over_r(r: np.ndarray) -> np.ndarray:
    safe = np.maximum(r, SMALL_RADIUS)
    return np.where(r < SMALL_RADIUS, 1.0 - r * r / 3.0, np.arctan(safe) / safe)


NO_DISTORTION = Distortion()
