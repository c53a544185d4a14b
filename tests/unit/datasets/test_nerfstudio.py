import numpy as np
import pytest

from core.datasets import check_capture, read_capture
from core.datasets.distortion import Distortion
from core.errors import (
    ImageMissing,
    ImageSizeMismatch,
    PoseNotFinite,
    PoseNotRigid,
    PosesInvalid,
    TooFewImages,
)
from core.normalisation import pose_in_user_frame
from tests.unit.datasets.captures import change_frame, nerfstudio, pose, write_photo


def test_shared_intrinsics_are_read(tmp_path):
    capture = read_capture(nerfstudio(tmp_path))
    camera = capture.train[0].camera
    assert (camera.focal_px, camera.centre_px, camera.size_px) == ((10.0, 11.0), (4.25, 2.75), (8, 6))
    np.testing.assert_allclose(pose_in_user_frame(capture.user_from_object, camera), pose(1), atol=1e-12)


@pytest.mark.parametrize("fields", [{"camera_model": "OPENCV_FISHEYE"}, {"is_fisheye": True}])
def test_fisheye_lenses_are_read(tmp_path, fields):
    lens = check_capture(nerfstudio(tmp_path, k1=0.01, k4=0.002, p1=0.5, **fields)).train[0].lens
    assert lens.distortion == Distortion(k1=0.01, k4=0.002, fisheye=True)


def test_every_eighth_photo_by_name_is_held_out(tmp_path):
    capture = read_capture(nerfstudio(tmp_path, count=18))
    assert [view.camera.name for view in capture.test] == ["0000", "0008", "0016"]
    assert len(capture.train) == 15


def test_two_photos_are_both_learnt_from(tmp_path):
    listing = check_capture(nerfstudio(tmp_path, count=2))
    assert (len(listing.train), len(listing.test)) == (2, 0)


def test_one_photo_is_too_few(tmp_path):
    with pytest.raises(TooFewImages):
        check_capture(nerfstudio(tmp_path, count=1))


def test_a_stated_split_is_used(tmp_path):
    nerfstudio(tmp_path, train_filenames=["images/0001.png", "images/0002.png"], test_filenames=["./images/0005.png"])
    listing = check_capture(tmp_path)
    assert [photo.camera.name for photo in listing.train] == ["0001", "0002"]
    assert [photo.camera.name for photo in listing.test] == ["0005"]


def test_a_frames_own_intrinsics_go_first(tmp_path):
    nerfstudio(tmp_path)
    write_photo(tmp_path / "images/0003.png", (16, 12), "RGB")
    change_frame(tmp_path, 3, fl_x=20, fl_y=22, cx=8.5, cy=5.5, w=16, h=12)
    photo = next(photo for photo in check_capture(tmp_path).photos if photo.camera.name == "0003")
    assert (photo.camera.focal_px, photo.camera.centre_px, photo.camera.size_px) == ((20, 22), (8.5, 5.5), (16, 12))


def test_angles_stand_in_for_focal_lengths(tmp_path):
    nerfstudio(tmp_path, fl_x=None, fl_y=None, cx=None, cy=None, w=None, h=None, camera_angle_x=0.8, camera_angle_y=0.5)
    camera = check_capture(tmp_path).train[0].camera
    assert camera.focal_px == pytest.approx((4 / np.tan(0.4), 3 / np.tan(0.25)))
    assert camera.centre_px == (4, 3)


def test_pixels_are_square_without_a_vertical_focal_length(tmp_path):
    assert check_capture(nerfstudio(tmp_path, fl_y=None)).train[0].camera.focal_px == (10, 10)


@pytest.mark.parametrize("spelling", ["images/0001", "./images/0001.png", "images\\0001.png", "elsewhere/0001.png"])
def test_photo_is_found_by_other_spellings(tmp_path, spelling):
    nerfstudio(tmp_path)
    if "elsewhere" in spelling:
        (tmp_path / "images/0001.png").rename(tmp_path / "0001.png")
    change_frame(tmp_path, 1, file_path=spelling)
    assert len(check_capture(tmp_path).photos) == 10


@pytest.mark.parametrize(
    "file_path",
    ["../secret.png", "/etc/passwd", "images/../../x.png", "..\\x.png", "C:\\x.png", "\\\\host\\x.png", "."],
)
def test_paths_that_lead_elsewhere_are_refused(tmp_path, file_path):
    write_photo(tmp_path / "secret.png")
    change_frame(nerfstudio(tmp_path / "capture"), 1, file_path=file_path)
    with pytest.raises(ImageMissing, match="inside the capture's folder"):
        check_capture(tmp_path / "capture")


def test_duplicate_frames_are_refused(tmp_path):
    change_frame(nerfstudio(tmp_path), 1, file_path="images/0002")
    with pytest.raises(PosesInvalid, match="one pose only"):
        check_capture(tmp_path)


def test_photo_of_another_size_than_stated_is_refused(tmp_path):
    nerfstudio(tmp_path)
    write_photo(tmp_path / "images/0004.png", (6, 8), "RGB")
    with pytest.raises(ImageSizeMismatch, match=r"0004\.png.*8 x 6.*6 x 8.*EXIF"):
        check_capture(tmp_path)


@pytest.mark.parametrize(
    "changes",
    [
        {"camera_model": "EQUIRECTANGULAR"},
        {"camera_model": 3},
        {"fl_x": "10"},
        {"fl_x": -3},
        {"fl_x": True},
        {"fl_x": float("inf")},
        {"fl_x": None, "fl_y": None},
        {"fl_x": None, "fl_y": None, "camera_angle_x": 4.0},
        {"w": 8.5},
        {"w": 0},
        {"cx": []},
        {"k1": "0"},
        {"frames": []},
        {"frames": {}},
        {"frames": [1]},
        {"frames": [{}]},
        {"frames": [{"file_path": 7, "transform_matrix": pose()}]},
        {"frames": [{"file_path": "images/0000.png"}]},
        {"test_filenames": "images/0000.png"},
    ],
)
def test_wrong_fields_are_refused(tmp_path, changes):
    with pytest.raises(PosesInvalid):
        check_capture(nerfstudio(tmp_path, **changes))


@pytest.mark.parametrize("content", ["", "{", "[]", "null", "\x00", '{"frames": ' + "[" * 100_000, "9" * 5000])
def test_what_is_not_a_json_object_is_refused(tmp_path, content):
    nerfstudio(tmp_path)
    (tmp_path / "transforms.json").write_text(content)
    with pytest.raises(PosesInvalid, match=r"transforms\.json"):
        check_capture(tmp_path)


def test_bytes_that_are_no_text_are_refused(tmp_path):
    nerfstudio(tmp_path)
    (tmp_path / "transforms.json").write_bytes(b"\xff\xfe\x80")
    with pytest.raises(PosesInvalid):
        check_capture(tmp_path)


def test_byte_order_mark_is_accepted(tmp_path):
    path = nerfstudio(tmp_path) / "transforms.json"
    path.write_bytes(b"\xef\xbb\xbf" + path.read_bytes())
    assert check_capture(tmp_path)


@pytest.mark.parametrize("matrix", [1, [], [[1]], pose()[:2], [[0.0] * 3] * 4, [["1"] * 4] * 4, [[True] * 4] * 4])
def test_matrix_of_another_shape_or_type_is_refused(tmp_path, matrix):
    with pytest.raises(PosesInvalid):
        check_capture(change_frame(nerfstudio(tmp_path), 2, transform_matrix=matrix))


@pytest.mark.parametrize("value", [float("nan"), float("inf"), 10**400])
def test_pose_that_is_not_finite_is_refused(tmp_path, value):
    matrix = pose(2)
    matrix[0][3] = value
    with pytest.raises(PoseNotFinite, match="0002"):
        check_capture(change_frame(nerfstudio(tmp_path), 2, transform_matrix=matrix))


@pytest.mark.parametrize("scale", [2.0, -1.0, 1.01])
def test_pose_that_is_not_rigid_is_refused(tmp_path, scale):
    matrix = pose(2)
    matrix[0] = [scale * value for value in matrix[0]]
    with pytest.raises(PoseNotRigid, match="0002"):
        check_capture(change_frame(nerfstudio(tmp_path), 2, transform_matrix=matrix))


def test_poses_are_checked_before_photos_are_opened(tmp_path):
    nerfstudio(tmp_path)
    (tmp_path / "images/0000.png").write_bytes(b"")
    matrix = pose()
    matrix[1][1] = float("nan")
    with pytest.raises(PoseNotFinite):
        check_capture(change_frame(tmp_path, 9, transform_matrix=matrix))
