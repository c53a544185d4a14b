"""Measuring while training."""

import numpy as np
import pytest

from benchmarks import watching
from benchmarks.chart import Curve, draw_chart
from benchmarks.watching import CurvePoint, Watch
from core.reconstruct import reconstruct
from tests.unit.benchmarks.toy import HASTY, small_survey
from tests.unit.training.captures import ball, capture_of


@pytest.fixture(scope="module")
def capture():
    return capture_of(ball())


def test_watching_measures_while_training_and_changes_nothing(capture, monkeypatch):
    monkeypatch.setattr(watching, "FIRST_S", 0.0)
    monkeypatch.setattr(watching, "GROWTH", 1.0)
    with small_survey():
        alone = reconstruct(capture, HASTY, device="cpu")
        with Watch(capture.test).attached() as watch:
            watched = reconstruct(capture, HASTY, device="cpu")
    assert {point.stage for point in watch.points} >= {"voxels", "texels"}
    seconds = [point.seconds for point in watch.points]
    assert seconds == sorted(seconds)
    assert all(np.isfinite(point.psnr) for point in watch.points)
    assert watch.points[-1].psnr > watch.points[0].psnr
    assert 0 < watch.paused_s < sum(watched.seconds.values())
    for one, other in zip(alone.scene.pages, watched.scene.pages, strict=True):
        np.testing.assert_array_equal(one.features_u8, other.features_u8)


def test_a_chart_is_drawn_even_of_a_curve_without_an_asset(tmp_path):
    pytest.importorskip("matplotlib")
    points = [CurvePoint(1.0, 10.0, "voxels"), CurvePoint(4.0, 20.0, "texels")]
    draw_chart(tmp_path / "chart.png", "title", [Curve("ours", points, (5.0, 21.0)), Curve("empty", points, None)])
    assert (tmp_path / "chart.png").stat().st_size > 1000
