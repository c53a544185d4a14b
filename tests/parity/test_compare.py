"""What counts as interior and what as flipped."""

import numpy as np
import pytest

from core.baked import BakedScene
from core.render.reference import visibility
from tests.parity.compare import compare, pixels_with_edges

NO_EDGES = np.zeros((8, 8), bool)
ALL_EDGES = np.ones((8, 8), bool)


@pytest.fixture
def image() -> np.ndarray:
    return np.concatenate([np.full((8, 8, 3), 0.5), np.ones((8, 8, 1))], -1)


def test_equal_images_are_all_interior(image: np.ndarray) -> None:
    comparison = compare(image, image, ALL_EDGES)
    assert (comparison.interior_psnr, comparison.flipped_share) == (120.0, 0.0)


def test_difference_on_an_edge_is_flipped(image: np.ndarray) -> None:
    other = image.copy()
    other[2, 3] = 0
    comparison = compare(other, image, ALL_EDGES)
    assert (comparison.interior_psnr, comparison.flipped_share) == (120.0, 1 / 64)


def test_difference_away_from_edges_is_interior(image: np.ndarray) -> None:
    other = image.copy()
    other[2, 3] = 0
    comparison = compare(other, image, NO_EDGES)
    assert comparison.interior_psnr < 25
    assert comparison.flipped_share == 0


def test_rounding_on_an_edge_is_interior(image: np.ndarray) -> None:
    comparison = compare(image + 0.5 / 255, image, ALL_EDGES)
    assert comparison.flipped_share == 0
    assert comparison.interior_psnr == pytest.approx(-20 * np.log10(0.5 / 255))


def test_empty_background_does_not_count(image: np.ndarray) -> None:
    padded = np.pad(image, ((0, 56), (0, 0), (0, 0)))
    edges = np.pad(ALL_EDGES, ((0, 56), (0, 0)))
    other = padded + 0.5 / 255 * (padded[..., 3:] > 0)
    assert compare(other, padded, edges).interior_psnr == pytest.approx(-20 * np.log10(0.5 / 255))


def test_silhouette_is_an_edge_and_empty_space_is_not(scene: BakedScene) -> None:
    camera = scene.cameras[0]
    edges = pixels_with_edges(scene, camera)
    hit = visibility(scene, camera).hit
    silhouette = hit[:, 1:] != hit[:, :-1]
    assert edges[:, 1:][silhouette].all()
    assert not edges[:10].any()  # the sheet leaves the top of this picture empty
    assert 0.05 < edges.mean() < 0.5
