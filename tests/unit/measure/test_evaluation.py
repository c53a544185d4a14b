from dataclasses import replace

import numpy as np
import pytest

from core.capture import View
from core.evaluation import Evaluation, ViewScore, comparison_picture, evaluate
from core.metrics import psnr
from core.render.composite import over, quantised
from core.render.reference import render_deferred


def photo_of(scene, camera):
    """What the scene looks like, as a photo."""
    return View(camera, quantised(over(render_deferred(scene, camera), scene.background)))


def test_perfect_reconstruction_scores_full_marks(scene):
    result = evaluate(scene, [photo_of(scene, camera) for camera in scene.cameras])
    assert [view.name for view in result.views] == [camera.name for camera in scene.cameras]
    # A value that lies within float32 rounding of half a step may round the other way.
    assert result.psnr > 80
    assert result.ssim > 0.99999


def test_means_are_over_views():
    result = Evaluation((ViewScore("a", 20.0, 0.5), ViewScore("b", 30.0, 1.0)))
    assert (result.psnr, result.ssim) == (25.0, 0.75)


def test_no_views_have_no_score(scene):
    result = evaluate(scene, [])
    assert (result.views, result.psnr, result.ssim) == ((), None, None)


def test_transparent_photo_is_compared_over_the_background(scene):
    scene = replace(scene, background=(0.2, 0.4, 0.6))
    empty = scene.cameras[0]
    away = empty.world_from_camera.copy()
    away[:3, 3] *= 1000
    view = View(replace(empty, world_from_camera=away), np.zeros((*empty.size_px[::-1], 4), np.uint8))
    # 0.2, 0.4 and 0.6 are whole bytes; the object is a single pixel at most.
    assert evaluate(scene, [view]).psnr > 35


def test_score_is_of_the_eight_bit_picture(scene):
    camera = scene.cameras[0]
    view = View(camera, np.full((*camera.size_px[::-1], 3), 128, np.uint8))
    rendered = quantised(over(render_deferred(scene, camera), scene.background)) / 255
    assert evaluate(scene, [view]).psnr == pytest.approx(psnr(np.full_like(rendered, 128 / 255), rendered), abs=1e-4)


def test_ignored_pixels_are_not_measured(scene):
    view = photo_of(scene, scene.cameras[0])
    spoilt, ignored = view.image_u8.copy(), np.zeros(view.image_u8.shape[:2], bool)
    spoilt[10:30, 30:60] ^= 128
    ignored[10:30, 30:60] = True
    result = evaluate(scene, [replace(view, image_u8=spoilt, ignored=ignored)])
    assert result.psnr > 80
    assert result.ssim > 0.99999


def test_photo_that_is_ignored_entirely_has_no_score(scene):
    view = photo_of(scene, scene.cameras[0])
    nothing = replace(view, ignored=np.ones(view.image_u8.shape[:2], bool))
    assert len(evaluate(scene, [nothing, view]).views) == 1


def test_progress_tells_every_view(scene):
    reports = []
    evaluate(scene, [photo_of(scene, camera) for camera in scene.cameras], progress=reports.append)
    assert [report.stage for report in reports] == ["measure"] * 3
    assert [report.fraction for report in reports] == pytest.approx([1 / 3, 2 / 3, 1])
    assert all(report.psnr > 60 for report in reports)


def test_comparison_shows_photo_render_and_where_they_differ(scene):
    view = photo_of(scene, scene.cameras[0])
    spoilt = view.image_u8.copy()
    spoilt[10:20, 30:40] ^= 128  # off by half the range
    picture = comparison_picture(scene, replace(view, image_u8=spoilt))
    photo, rendered, error = np.split(picture, 3, 1)
    np.testing.assert_array_equal(photo, spoilt)
    assert np.abs(rendered.astype(int) - view.image_u8).max() <= 1
    assert (error[10:20, 30:40] == 255).all()
    error[10:20, 30:40] = 0
    assert error.max() <= 12  # one step of 8 bits, enlarged


def test_composite_of_uncovered_pixels_is_the_background():
    background = (0.1, 0.5, 1.0)
    np.testing.assert_allclose(over(np.zeros((2, 2, 4)), background), np.broadcast_to(background, (2, 2, 3)))


def test_composite_blends_by_coverage():
    np.testing.assert_allclose(over(np.array([0.25, 0.0, 0.1, 0.5]), (1.0, 1.0, 0.0)), [0.75, 0.5, 0.1])


def test_quantising_rounds_and_clamps():
    np.testing.assert_array_equal(
        quantised(np.array([-1.0, 0.0, 0.499 / 255, 0.501 / 255, 1.0, 2.0])), [0, 0, 0, 1, 255, 255]
    )
