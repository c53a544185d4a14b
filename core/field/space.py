"""The three parameterisations of space (supplement H): where a grid's cells lie.

*Scene* points are what rays and vertices are in: the object frame, moved, turned and scaled by `Frame`. *Grid* points
fill the cube [-1, 1]^3 that the voxel field's nodes and the mesh's cells divide evenly.

CUBE    an object: the grid is the scene's cube [-1, 1]^3 itself (eq. 22).
TAPER   forward-facing: all cameras look along +z. Depth 1..reach is divided evenly by its logarithm, and cells widen
        with depth, so that all look alike from the cameras (eq. 23).
SHELLS  unbounded: cameras and what they look at lie within the scene's cube [-1, 1]^3. Around it stand concentric
        cubes out to `reach` half edges; they begin as far apart as cells and grow exponentially apart (eq. 24). The
        voxel field holds the cube in the middle of its grid, and the surroundings, contracted, around it.
"""

from dataclasses import dataclass

import numpy as np
import warp as wp

from core.kernels.space import CUBE, SHELLS, TAPER
from core.kernels.space import Space as KernelSpace

# Of the contracted grid, the half edge that the cube in the middle takes.
INNER = 0.5
PAPER_TANGENT = 0.875  # u / 2 of eq. 23
PAPER_DEPTHS = 25.0
PAPER_SHELLS = 16.0  # d_L = 8, in half edges of the unit cube


@dataclass(frozen=True)
class Space:
    """A parameterisation.

    Attributes:
        kind: CUBE, TAPER or SHELLS.
        tangent: TAPER: half width and half height of the grid at depth 1.
        reach: TAPER: the depth of the farthest plane; SHELLS: half the edge of the outermost shell. > 1.
    """

    kind: int = CUBE
    tangent: tuple[float, float] = (1.0, 1.0)
    reach: float = 1.0

    @classmethod
    def cube(cls) -> "Space":
        return cls()

    @classmethod
    def taper(cls, tangent: tuple[float, float] = (PAPER_TANGENT,) * 2, reach: float = PAPER_DEPTHS) -> "Space":
        return cls(TAPER, tangent, reach)

    @classmethod
    def shells(cls, reach: float = PAPER_SHELLS) -> "Space":
        return cls(SHELLS, (1.0, 1.0), reach)

    @property
    def growth(self) -> float:
        """TAPER: ln(reach), w of eq. 23. SHELLS: w of eq. 24, so that (exp(w) - 1) / w = reach - 1."""
        if self.kind == TAPER:
            return float(np.log(self.reach))
        if self.kind == CUBE:
            return 1.0
        return _growth(self.reach - 1.0)

    @property
    def inner(self) -> float:
        """Half the edge, in the grid, of the cube that the scene's cube [-1, 1]^3 becomes."""
        return INNER if self.kind == SHELLS else 1.0

    def to_grid(self, points: np.ndarray) -> np.ndarray:
        """Grid points of scene points [..., 3], float64."""
        p = np.asarray(points, np.float64)
        if self.kind == TAPER:
            z = p[..., 2:]
            return np.concatenate([p[..., :2] / (z * np.array(self.tangent)), 2 * np.log(z) / self.growth - 1], -1)
        if self.kind == SHELLS:
            m = np.abs(p).max(-1, keepdims=True)
            outside = np.log1p(self.growth * np.maximum(m - 1.0, 0.0)) / self.growth
            return p * np.where(m <= 1.0, INNER, (INNER + (1.0 - INNER) * outside) / np.maximum(m, 1.0))
        return p

    def to_scene(self, points: np.ndarray) -> np.ndarray:
        """Scene points of grid points [..., 3] in [-1, 1]^3, float64."""
        g = np.asarray(points, np.float64)
        if self.kind == TAPER:
            z = np.exp(self.growth * (g[..., 2:] + 1.0) / 2.0)
            return np.concatenate([g[..., :2] * np.array(self.tangent) * z, z], -1)
        if self.kind == SHELLS:
            m = np.abs(g).max(-1, keepdims=True)
            tau = (np.maximum(m, INNER) - INNER) / (1.0 - INNER)
            return g * np.where(
                m <= INNER, 1.0 / INNER, (1.0 + np.expm1(self.growth * tau) / self.growth) / np.maximum(m, INNER)
            )
        return g

    def cells_to_scene(self, points: np.ndarray) -> np.ndarray:
        """Scene points of points of the mesh's cells' cube [-1, 1]^3: the grid; for SHELLS the cube in its middle."""
        return self.to_scene(points) if self.kind == TAPER else np.asarray(points, np.float64)

    def backdrop(self, cells: int) -> np.ndarray:
        """[cells]^3 bool: the grid's cells at the far end, where every ray ends that meets nothing before; none in a
        CUBE, whose surroundings are empty."""
        far = np.zeros((cells,) * 3, bool)
        if self.kind == TAPER:
            far[:, :, -1] = True
        elif self.kind == SHELLS:
            far[:] = True
            far[1:-1, 1:-1, 1:-1] = False
        return far

    def shell_halves(self, count: int) -> np.ndarray:
        """[count + 1] float64: half the edges of the shells, from 1 to reach (eq. 24); none unless SHELLS."""
        if self.kind != SHELLS:
            return np.zeros(0)
        return 1.0 + np.expm1(self.growth * np.arange(count + 1) / count) / self.growth

    def kernel_space(self) -> KernelSpace:
        space = KernelSpace()
        space.kind, space.tangent = self.kind, wp.vec2(*self.tangent)
        space.reach, space.growth, space.inner = self.reach, self.growth, self.inner
        return space


def _growth(total: float) -> float:
    """w > 0 with (exp(w) - 1) / w = total, for total > 1; by bisection."""
    low, high = 0.0, 60.0
    for _ in range(200):
        middle = (low + high) / 2.0
        low, high = (middle, high) if np.expm1(middle) < total * middle else (low, middle)
    return max(high, 1e-9)
