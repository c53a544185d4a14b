"""Exposure differences between photos: told from shine, and evened."""

from copy import deepcopy
from dataclasses import dataclass, replace

import numpy as np
import pytest
import torch

from core.capture import Capture
from core.field.network import new_network
from core.field.region import find_region
from core.presets import settings_for
from core.training.exposure import (
    LEAST_PIXELS,
    LEAST_SPREAD,
    BrightnessSurvey,
    evened,
    exposure_differences,
    spread_of,
)
from core.training.pixels import PixelPool
from core.training.voxel_stage import VoxelStage
from tests.unit.training.captures import ball, capture_of, ring_cameras
from tests.unit.training.test_pixels import FRAME, marked_views, without_alpha

CAMERAS = ring_cameras(60, 8)
PLACES = np.array([camera.position for camera in CAMERAS])
SETTINGS = settings_for(
    "draft", cells=12, patch=3, nodes=32, voxel_steps=120, field_steps=1, texel_steps=1, voxel_batch=512
)


def as_seen(gains: np.ndarray, rng, pixels: int = 4000) -> np.ndarray:
    """The survey's result for a scene of random colours, photographed with gains [photos, 3]."""
    survey = BrightnessSurvey(len(gains), "cpu")
    image = torch.from_numpy(rng.integers(0, len(gains), pixels))
    color, coverage = torch.rand(pixels, 3) * 0.5, torch.ones(pixels)
    survey.add(color, coverage, color * torch.from_numpy(gains)[image].float(), coverage, image)
    return survey.log_ratios()


def test_gains_are_measured(rng):
    gains = np.exp(rng.normal(0, 0.2, (20, 3)))
    # float32 colours.
    np.testing.assert_allclose(as_seen(gains, rng), np.log(gains), atol=1e-5)


def test_empty_pixels_do_not_count(rng):
    survey, n = BrightnessSurvey(1, "cpu"), LEAST_PIXELS
    bright, dark, image = torch.full((n, 3), 0.8), torch.full((n, 3), 0.2), torch.zeros(n, dtype=torch.int64)
    full, empty = torch.ones(n), torch.zeros(n)
    survey.add(bright, full, bright, full, image)
    survey.add(bright, full, dark, empty, image)
    survey.add(bright, empty, dark, full, image)
    np.testing.assert_allclose(survey.log_ratios(), 0.0, atol=1e-6)


def test_photos_that_show_too_little_are_not_judged(rng):
    survey = BrightnessSurvey(2, "cpu")
    pixels = LEAST_PIXELS - 1
    color, image = torch.ones(pixels, 3), torch.zeros(pixels, dtype=torch.int64)
    survey.add(color, torch.ones(pixels), 0.5 * color, torch.ones(pixels), image)
    assert np.isnan(survey.log_ratios()).all()
    known = rng.normal(0, 0.1, (60, 3))
    known[7] = np.nan
    differences = exposure_differences(known, CAMERAS)
    assert (differences[7] == 0).all()
    assert np.isfinite(differences).all()


def test_shine_is_no_exposure(rng):
    """What grows towards one side, or towards the zenith, is how the scene looks from there."""
    shine = 0.3 * PLACES[:, :1] / 4 + 0.2 * (PLACES[:, 2:] / 4) ** 2 * [1.0, 0.5, 0.1]
    assert np.abs(exposure_differences(shine, CAMERAS)).max() < 1e-9


def test_differences_between_neighbours_are_exposure(rng):
    jumps = rng.normal(0, 0.15, (60, 3))
    shine = 0.3 * PLACES[:, :1] / 4
    found = exposure_differences(jumps + shine, CAMERAS)
    # 12 of 60 dimensions look like shine: sqrt(12 / 60) of the spread is lost.
    assert spread_of(found - jumps) < 0.5 * 0.15
    assert spread_of(found) > max(0.8 * 0.15, LEAST_SPREAD)
    np.testing.assert_allclose(found.mean(0), 0.0, atol=1e-9)


@pytest.mark.parametrize("count", [2, 5, 13])
def test_few_photos_tell_nothing(rng, count):
    assert not exposure_differences(rng.normal(0, 0.2, (count, 3)), CAMERAS[:count]).any()


def test_cameras_on_a_line_and_at_one_place_are_fine(rng):
    camera = CAMERAS[0]
    ratios = rng.normal(0, 0.1, (30, 3))
    np.testing.assert_allclose(exposure_differences(ratios, [camera] * 30), ratios - ratios.mean(0), atol=1e-9)
    rail = [replace(camera, world_from_camera=camera.world_from_camera + 1e-3 * i * np.eye(4, k=3)) for i in range(30)]
    assert np.isfinite(exposure_differences(ratios, rail)).all()


def test_evened_colours_are_divided_by_the_gain():
    color = torch.tensor([[0.2, 0.4, 1.0], [0.2, 0.4, 1.0]])
    gains = torch.tensor([[2.0, 1.0, 2.0], [0.5, 0.5, 0.5]])
    expected = torch.tensor([[0.1, 0.4, 1.0], [0.4, 0.8, 2.0]])  # saturated: at least 1
    torch.testing.assert_close(evened(color, gains.log()), expected)


@pytest.mark.parametrize("change", [lambda view: view, without_alpha])
def test_batches_are_freed_of_their_photos_exposure(rng, change):
    views = [change(view) for view in marked_views(rng)]
    pool = PixelPool(views, FRAME, "cpu")
    plain = pool.draw(1, 200, supersampled=False)
    pool.log_gains = torch.tensor([[0.3, 0.2, 0.1], [-0.3, -0.2, -0.1]])
    freed = pool.draw(1, 200, supersampled=False)
    torch.testing.assert_close(freed.color, plain.color * torch.exp(-pool.log_gains[plain.image]))
    torch.testing.assert_close(freed.alpha, plain.alpha)


def exposed(capture: Capture, gains: np.ndarray) -> Capture:
    """The capture, its training photos times gains [photos]."""
    train = []
    for view, gain in zip(capture.train, gains, strict=True):
        image = view.image_u8.astype(float)
        image[..., :3] *= gain
        train.append(replace(view, image_u8=np.rint(np.clip(image, 0, 255)).astype(np.uint8)))
    return replace(capture, train=tuple(train))


def trained(capture: Capture, until: float = 1.0) -> VoxelStage:
    stage = VoxelStage(capture, find_region(capture), new_network(0), SETTINGS, 0, "cpu")
    while stage.fraction < until:
        stage.advance()
    return stage


@dataclass(frozen=True)
class Watched:
    """A capture whose photos are exposed unlike, a stage that has trained on it, and the same at two thirds."""

    capture: Capture
    gains: np.ndarray
    stage: VoxelStage
    earlier: dict


@pytest.fixture(scope="module")
def watched() -> Watched:
    gains = np.random.default_rng(0).uniform(0.75, 1.25, 40)
    capture = exposed(capture_of(ball(), views=40, held_out=1), gains)
    stage = trained(capture, 0.66)
    earlier = deepcopy(stage.state())
    while stage.done < stage.steps:
        stage.advance()
    return Watched(capture, gains, stage, earlier)


def test_photos_exposed_unlike_are_evened_while_the_field_trains(watched):
    truth = np.log(watched.gains) - np.log(watched.gains).mean()
    found = watched.stage.log_gains.mean(1).numpy()
    # What looks like shine, 12 of 40 dimensions, is left to it.
    assert spread_of(found - truth) < 0.7 * spread_of(truth)
    assert np.corrcoef(found, truth)[0, 1] > 0.8
    assert watched.stage._pool.log_gains is watched.stage.log_gains


def test_a_stage_that_goes_on_knows_the_exposures(watched):
    again = VoxelStage(watched.capture, find_region(watched.capture), new_network(0), SETTINGS, 0, "cpu")
    again.restore(watched.earlier)
    assert torch.equal(again._pool.log_gains, watched.earlier["log_gains"])


def test_photos_exposed_alike_are_left_as_they_are():
    assert trained(capture_of(ball(), views=40, held_out=1)).log_gains is None
