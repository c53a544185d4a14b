"""What every triangle of a scene shows, by the triangle's place in space: to compare scenes with other pages."""

import numpy as np

from core.baked import BakedScene
from core.conventions import feature_from_byte, is_opaque

BORDER = 0.01  # of a texel: nearer to its border, float32 may round a lookup to either side


class Lookups:
    """Texels at the same points of the same triangles.

    Args:
        barycentric: [n, 3] points within a triangle.
    """

    def __init__(self, scene: BakedScene, barycentric: np.ndarray) -> None:
        self.network = scene.network
        found = [_of_page(page, barycentric) for page in scene.pages]
        self._row = {key: row for row, key in enumerate(key for keys, *_ in found for key in keys)}
        self._texels = np.concatenate([texels for _, texels, _ in found])
        self._clear = np.concatenate([clear for _, _, clear in found])

    def paired(self, other: "Lookups") -> tuple[np.ndarray, np.ndarray]:
        """uint8 texels [m, 11] here and there, of triangles that both have, away from texels' borders."""
        keys = [key for key in self._row if key in other._row]
        here, there = (np.array([lookups._row[key] for key in keys]) for lookups in (self, other))
        clear = self._clear[here] & other._clear[there]
        return self._texels[here][clear], other._texels[there][clear]

    def triangles(self) -> set[bytes]:
        return set(self._row)


def random_points(count: int, seed: int = 0) -> np.ndarray:
    """[count, 3] barycentric coordinates, uniform."""
    return np.random.default_rng(seed).dirichlet((1, 1, 1), count)


def color_psnr(before: Lookups, after: Lookups, seed: int = 0) -> float:
    """dB between what the networks show of texels that are opaque in both, from random directions."""
    texels, others = before.paired(after)
    both = is_opaque(texels) & is_opaque(others)
    directions = np.random.default_rng(seed).normal(size=(int(both.sum()), 3))
    directions /= np.linalg.norm(directions, axis=-1, keepdims=True)
    shown = before.network(feature_from_byte(texels[both][:, :8]), directions)
    other = after.network(feature_from_byte(others[both][:, :8]), directions)
    return float(-10 * np.log10(max(((shown - other) ** 2).mean(), 1e-12)))


def _of_page(page, barycentric):  # type: ignore[no-untyped-def]
    corners = page.positions[page.triangles]
    texcoords = np.einsum("nk,tkc->tnc", barycentric, page.texcoords[page.triangles].astype(np.float64))
    height, width = page.features_u8.shape[:2]
    at = texcoords * (width, height)
    x, y = np.clip(np.floor(at), 0, (width - 1, height - 1)).astype(int).transpose(2, 0, 1)
    texels = np.concatenate([page.features_u8[y, x], page.colors_u8[y, x]], -1)
    clear = (np.abs(at - np.rint(at)) > BORDER).all(-1)
    return [triangle.tobytes() for triangle in corners], texels, clear
