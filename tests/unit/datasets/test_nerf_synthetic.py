import numpy as np
import pytest

from core.datasets import check_capture, read_capture
from core.errors import ImageMissing, ImageSizeMismatch, PosesInvalid, TooFewImages
from core.normalisation import pose_in_user_frame
from tests.unit.datasets.captures import pose, synthetic, write_json, write_photo


def test_split_and_cameras_are_as_stated(tmp_path):
    capture = read_capture(synthetic(tmp_path))
    assert [view.camera.name for view in capture.train] == ["r_0", "r_1", "r_2", "r_3"]
    assert [view.camera.name for view in capture.test] == ["r_0", "r_1"]
    camera = capture.train[1].camera
    assert camera.size_px == (8, 6)
    assert camera.centre_px == (4.0, 3.0)
    assert camera.focal_px == pytest.approx((4 / np.tan(0.345),) * 2)
    np.testing.assert_allclose(pose_in_user_frame(capture.user_from_object, camera), pose(1), atol=1e-12)
    assert capture.train[0].image_u8[0, 0].tolist() == [200, 120, 40, 180]


def test_without_a_test_file_every_eighth_photo_is_held_out(tmp_path):
    listing = check_capture(synthetic(tmp_path, train=10, test=0))
    assert [photo.camera.name for photo in listing.test] == ["r_0", "r_8"]
    assert len(listing.train) == 8


def test_validation_file_is_ignored(tmp_path):
    synthetic(tmp_path)
    (tmp_path / "transforms_val.json").write_text("not JSON")
    assert len(check_capture(tmp_path).photos) == 6


def test_photos_of_different_sizes_are_refused(tmp_path):
    synthetic(tmp_path)
    write_photo(tmp_path / "train/r_2.png", (9, 6))
    with pytest.raises(ImageSizeMismatch, match=r"train/r_2\.png.*9 x 6.*8 x 6"):
        check_capture(tmp_path)


def test_missing_photos_are_named_up_to_five(tmp_path):
    synthetic(tmp_path, train=9)
    for index in range(7):
        (tmp_path / f"train/r_{index}.png").unlink()
    with pytest.raises(ImageMissing, match=r"7 missing: .*r_0.*r_4 and 2 more"):
        check_capture(tmp_path)


def test_missing_photos_can_be_left_out_with_a_note(tmp_path):
    synthetic(tmp_path)
    (tmp_path / "train/r_3.png").unlink()
    capture = read_capture(tmp_path, skip_missing=True)
    assert len(capture.train) == 3
    assert "./train/r_3" in capture.notes[0]


def test_one_photo_is_too_few(tmp_path):
    with pytest.raises(TooFewImages, match="1"):
        check_capture(synthetic(tmp_path, train=1))


def test_the_same_photo_in_both_splits_is_refused(tmp_path):
    synthetic(tmp_path)
    frames = [{"file_path": "./train/r_0", "transform_matrix": pose(0)}]
    write_json(tmp_path / "transforms_test.json", {"camera_angle_x": 0.69, "frames": frames})
    with pytest.raises(PosesInvalid, match="one pose only"):
        check_capture(tmp_path)
