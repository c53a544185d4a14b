"""True depths in the object frame, and the rows of benchmarks.geometry."""

import numpy as np
import pytest

from benchmarks.geometry import COLUMNS, GeometryRow, measure, size_of, true_depths
from core.baked import BakedScene
from core.datasets import read_capture
from core.sample import sample_depth, write_sample_capture
from core.sample.cameras import orbit_cameras
from exporters.gltf import write_glb
from tests.scenes import tiny_scene


@pytest.fixture(scope="module")
def capture(tmp_path_factory):
    folder = tmp_path_factory.mktemp("sample")
    write_sample_capture(folder, size_px=32, train_views=4, test_views=2)
    return read_capture(folder)


def test_true_depths_are_the_samples_own_in_object_units(capture):
    cameras = [view.camera for view in capture.test]
    scale = np.cbrt(np.linalg.det(capture.user_from_object[:3, :3]))
    for camera, truth, user_camera in zip(cameras, true_depths(capture, cameras), orbit_cameras(2, 32, 0), strict=True):
        # The poses go through a file as decimal numbers, and there and back as float64.
        expected = sample_depth(user_camera)
        both = np.isfinite(truth) & np.isfinite(expected)
        assert (np.isfinite(truth) == np.isfinite(expected)).mean() > 0.99
        np.testing.assert_allclose(truth[both] * scale, expected[both], rtol=1e-4)
        assert camera.name == user_camera.name


def test_true_depth_is_finite_where_the_photo_shows_something(capture):
    cameras = [view.camera for view in capture.test]
    for view, truth in zip(capture.test, true_depths(capture, cameras), strict=True):
        covered = view.image_u8[..., 3] > 127
        assert (np.isfinite(truth) == covered).mean() > 0.97  # but for pixels that are partly covered


def test_the_scenes_size_is_of_the_order_of_its_units(capture):
    cameras = [view.camera for view in capture.test]
    # The still life stands on a table of about two units, seen from 4.03, which becomes 1.
    assert 0.3 < size_of(cameras, true_depths(capture, cameras)) < 0.8


def test_an_asset_of_something_else_is_all_wrong_and_still_measured(capture):
    scene: BakedScene = tiny_scene()
    rows, picture = measure({"one": write_glb(scene)["scene.glb"]}, capture, ("photos", "hardware"), 0)
    assert isinstance(rows[0], GeometryRow)
    assert len(rows[0].cells()) == len(COLUMNS)
    assert rows[0].scores["holes"] > 0.1
    assert picture.shape == (32, 96, 3)
    assert picture.dtype == np.uint8
