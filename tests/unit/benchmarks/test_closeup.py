"""Close-ups of the sample: where their cameras stand, what counts as a pinhole, and the rows."""

import numpy as np
import pytest

from benchmarks.closeup import BACKGROUNDS, COLUMNS, background, closeup_cameras, measure, pinholes, true_photos
from benchmarks.geometry import true_depths
from core.datasets import read_capture
from core.sample import write_sample_capture
from exporters.gltf import write_glb
from tests.scenes import tiny_scene


@pytest.fixture(scope="module")
def capture(tmp_path_factory):
    folder = tmp_path_factory.mktemp("sample")
    write_sample_capture(folder, size_px=32, train_views=4, test_views=3)
    return read_capture(folder)


def test_close_up_cameras_stand_at_a_third_of_the_distance(capture):
    closer = {camera.name: camera for camera in closeup_cameras(capture, 48)}
    cameras = [view.camera for view in capture.test]
    assert closer
    for camera, depth in zip(cameras, true_depths(capture, cameras), strict=True):
        if camera.name not in closer:
            assert not np.isfinite(depth[16, 16])
            continue
        near = closer[camera.name]
        assert near.size_px == (48, 48)
        assert np.linalg.norm(near.position - camera.position) == pytest.approx(depth[16, 16] * 2 / 3)
        # What was in the middle still is, at a third of the distance.
        now = true_depths(capture, [near.resized((32, 32))])[0]
        assert now[16, 16] == pytest.approx(depth[16, 16] / 3, rel=0.02)


def test_true_photos_are_the_samples_own(capture):
    cameras = [view.camera for view in capture.test]
    for photo, view in zip(true_photos(capture, cameras), capture.test, strict=True):
        alpha = view.image_u8[..., 3:] / 255.0
        # Poses go through a file; a photo's bytes round what the renderer says.
        assert np.abs(photo[..., :3] - view.image_u8[..., :3] / 255.0 * alpha).mean() < 0.01


@pytest.mark.parametrize(("side", "count"), [(1, 1), (6, 1), (7, 0), (20, 0)])
def test_pinholes_are_small_uncovered_places(side, count):
    truth, rendered = np.ones((1000, 1000)), np.ones((1000, 1000))
    rendered[100 : 100 + side, 200 : 200 + side] = 0.2  # 36 px count, 49 do not
    assert pinholes(rendered, truth) == count
    truth[100 : 100 + side, 200 : 200 + side] = 0.9  # the outline: not covered in truth either
    assert pinholes(rendered, truth) == 0


@pytest.mark.parametrize(("name", "mean"), [("white", 1.0), ("grey", 0.5), ("black", 0.0), ("checkers", 0.5)])
def test_backgrounds(name, mean):
    assert background(name, (32, 48)).shape == (32, 48, 3)
    assert background(name, (32, 48)).mean() == pytest.approx(mean)


def test_any_asset_gets_a_row_and_a_picture(capture):
    rows, picture = measure({"one": write_glb(tiny_scene())["scene.glb"]}, capture, 32, "hardware")
    assert set(rows[0].psnr) == set(BACKGROUNDS)
    assert len(rows[0].cells()) == len(COLUMNS)
    assert picture.shape == (32, 96, 3)
