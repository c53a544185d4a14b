"""Recoded features show the same colours."""

import numpy as np
import pytest

from core.baked import BakedScene, ShaderNetwork
from core.conventions import feature_from_byte
from exporters.compaction.recoding import CHANNEL_ORDER, Recoding, recoding_of
from exporters.compaction.surface import SurfacePoints, surface_points


@pytest.fixture
def seen(scene: BakedScene) -> SurfacePoints:
    return surface_points(scene, 4000)


@pytest.fixture
def recoding(scene: BakedScene, seen: SurfacePoints) -> Recoding:
    return recoding_of(scene.network, seen)


def error(scene: BakedScene, seen: SurfacePoints, recoding: Recoding) -> np.ndarray:
    """[n] squared distances of colours."""
    coded = recoding.bytes_of(recoding.coordinates(seen.features_u8))
    before = scene.network(feature_from_byte(seen.features_u8), seen.directions)
    after = recoding.network(scene.network)(feature_from_byte(coded), seen.directions)
    return ((before - after) ** 2).sum(-1)


def test_fine_steps_keep_colours(scene: BakedScene, seen: SurfacePoints, recoding: Recoding) -> None:
    fine = recoding.with_step(1e-4)
    # 254 levels over the whole range of each channel, as the features had.
    assert np.sqrt(error(scene, seen, fine).mean()) < 2 / 255


@pytest.mark.parametrize("step", [2 / 255, 4 / 255, 8 / 255])
def test_error_is_what_the_recoding_says(
    scene: BakedScene, seen: SurfacePoints, recoding: Recoding, step: float
) -> None:
    coarse = recoding.with_step(step)
    # Colours are taken for linear in the features within a step.
    assert error(scene, seen, coarse).mean() == pytest.approx(coarse.squared_error(), rel=0.25)


def test_mean_of_recoded_features_shows_the_mean_of_features(
    scene: BakedScene, seen: SurfacePoints, recoding: Recoding
) -> None:
    # A pixel averages features before it is shaded: an affine recoding commutes with that.
    fours = seen.features_u8[:2000].reshape(-1, 4, 8)
    directions = seen.directions[: len(fours)]
    coded = recoding.with_step(1e-4)
    before = scene.network(feature_from_byte(fours).mean(1), directions)
    means = feature_from_byte(coded.bytes_of(coded.coordinates(fours))).mean(1)
    after = coded.network(scene.network)(means, directions)
    assert np.sqrt(((before - after) ** 2).mean()) < 1 / 255


def test_opaque_texels_stay_opaque(seen: SurfacePoints, recoding: Recoding) -> None:
    for step in (1e-4, 0.02, 0.5, 1.0):
        coarse = recoding.with_step(step)
        assert coarse.bytes_of(coarse.coordinates(seen.features_u8))[:, 0].min() >= 1


def test_channels_are_uncorrelated_and_ordered(seen: SurfacePoints, recoding: Recoding) -> None:
    y = recoding.coordinates(seen.features_u8).astype(np.float64)
    covariance = np.cov(y.T)
    off_diagonal = covariance - np.diag(np.diag(covariance))
    assert np.abs(off_diagonal).max() < 1e-3 * covariance.max()
    assert np.argsort(np.argsort(recoding.deviation)).tolist() == CHANNEL_ORDER


def test_channel_that_the_network_ignores_is_left_out(scene: BakedScene, seen: SurfacePoints) -> None:
    w0, w1, w2 = scene.network.weights
    deaf = w0.copy()
    deaf[:, 5] = 0
    network = ShaderNetwork((deaf, w1, w2), scene.network.biases)
    coarse = recoding_of(network, seen).with_step(2 / 255)
    assert (coarse.step == 0).sum() == 1
    coded = coarse.bytes_of(coarse.coordinates(seen.features_u8))
    assert (coded.min(0) == coded.max(0)).sum() == 1


def test_constant_colour_leaves_every_channel_out(scene: BakedScene) -> None:
    zeros = tuple(np.zeros_like(w) for w in scene.network.weights)
    network = ShaderNetwork(zeros, scene.network.biases)  # type: ignore[arg-type]
    points = surface_points(scene, 100)
    coarse = recoding_of(network, points).with_step(1 / 255)
    assert (coarse.step == 0).all()
    np.testing.assert_array_equal(
        coarse.bytes_of(coarse.coordinates(points.features_u8)), [[1] + [0] * 7] * len(points.features_u8)
    )
