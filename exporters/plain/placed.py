"""Vertices where the asset has them."""

import numpy as np

from core.baked import BakedScene, Page


def placed(scene: BakedScene, page: Page) -> np.ndarray:
    """[V, 3] float64: a page's vertices in the asset's frame."""
    matrix = scene.asset_from_object
    found: np.ndarray = page.positions.astype(np.float64) @ matrix[:3, :3].T + matrix[:3, 3]
    return found
