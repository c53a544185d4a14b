import numpy as np
import pytest

from core.datasets import check_capture, read_capture
from core.errors import ImageSizeMismatch, NoImages, PoseNotFinite, PoseNotRigid, PosesInvalid
from core.normalisation import pose_in_user_frame
from tests.unit.datasets.captures import llff, llff_rows, pose, write_photo


def test_axes_and_intrinsics_are_read(tmp_path):
    capture = read_capture(llff(tmp_path))
    view = capture.train[0]  # photo 1: 0 is held out
    assert view.camera.name == "image001"
    assert (view.camera.size_px, view.camera.focal_px, view.camera.centre_px) == ((8, 6), (10.0, 10.0), (4.0, 3.0))
    np.testing.assert_allclose(pose_in_user_frame(capture.user_from_object, view.camera), pose(1), atol=1e-12)


def test_bounds_are_kept_in_object_units(tmp_path):
    capture = read_capture(llff(tmp_path))
    scale = np.cbrt(np.linalg.det(capture.user_from_object[:3, :3]))
    assert capture.train[0].depth_range == pytest.approx((1.1 / scale, 20 / scale))


def test_every_eighth_photo_is_held_out(tmp_path):
    listing = check_capture(llff(tmp_path))
    assert [photo.camera.name for photo in listing.test] == ["image000", "image008"]
    assert not listing.up_known


@pytest.mark.parametrize("path", [".", "images_4", "poses_bounds.npy"])
def test_folder_photos_and_pose_file_name_the_capture(tmp_path, path):
    assert len(check_capture(llff(tmp_path) / path).photos) == 10


@pytest.mark.parametrize(
    ("options", "folder", "size"),
    [
        ({}, "images", (32, 24)),
        ({"downscale": 2}, "images", (16, 12)),
        ({"downscale": 4}, "images_4", (8, 6)),
        ({"downscale": 5}, "images_4", (6, 5)),
        ({"downscale": 8}, "images_8", (4, 3)),
        ({"max_size_px": 8}, "images_4", (8, 6)),
        ({"max_size_px": 7}, "images_4", (7, 5)),
        ({"downscale": 16}, "images_8", (2, 2)),
    ],
)
def test_fitting_copy_of_the_photos_is_taken(tmp_path, options, folder, size):
    capture = read_capture(llff(tmp_path, photos=("images", "images_4", "images_8")), **options)
    assert capture.train[0].camera.size_px == size
    # The photo's field of view is that of the pose file, whatever copy is read.
    assert capture.train[0].camera.focal_px[0] / size[0] == pytest.approx(40 / 32)
    assert ([f"Photos are taken from {folder}."] if folder != "images" else []) == list(capture.notes)


def test_largest_copy_is_taken_where_the_full_size_is_missing(tmp_path):
    llff(tmp_path, photos=("images_4", "images_8"))
    assert read_capture(tmp_path).train[0].camera.size_px == (8, 6)
    assert read_capture(tmp_path, downscale=2).train[0].camera.size_px == (8, 6)
    assert read_capture(tmp_path, downscale=8).train[0].camera.size_px == (4, 3)


def test_downscale_is_relative_to_a_named_folder(tmp_path):
    llff(tmp_path, photos=("images", "images_4"))
    assert read_capture(tmp_path / "images_4", downscale=2).train[0].camera.size_px == (4, 3)


def test_photos_may_lie_beside_the_poses(tmp_path):
    for index in range(10):
        write_photo(tmp_path / f"image{index:03}.png", (8, 6), "RGB")
    np.save(tmp_path / "poses_bounds.npy", llff_rows())
    assert len(check_capture(tmp_path).photos) == 10


def test_photos_must_be_as_many_as_poses(tmp_path):
    llff(tmp_path)
    (tmp_path / "images_4/image003.png").unlink()
    with pytest.raises(PosesInvalid, match="10 rows for 9 photos in images_4"):
        check_capture(tmp_path)


def test_cropped_photo_is_refused(tmp_path):
    llff(tmp_path)
    write_photo(tmp_path / "images_4/image003.png", (8, 8), "RGB")
    with pytest.raises(ImageSizeMismatch, match="image003"):
        check_capture(tmp_path)


def test_turned_photo_is_refused(tmp_path):
    llff(tmp_path, photos=("images",))
    write_photo(tmp_path / "images/image003.png", (24, 32), "RGB")
    with pytest.raises(ImageSizeMismatch, match="EXIF"):
        check_capture(tmp_path)


def test_no_photos(tmp_path):
    np.save(tmp_path / "poses_bounds.npy", llff_rows())
    write_photo(tmp_path / "masks/image000.png")
    with pytest.raises(NoImages):
        check_capture(tmp_path)


@pytest.mark.parametrize(
    ("column", "value", "error"),
    [
        (3, np.nan, PoseNotFinite),
        (0, 3.0, PoseNotRigid),
        (14, 0.0, PosesInvalid),
        (4, 0.0, PosesInvalid),
        (9, -5.0, PosesInvalid),
        (15, 0.0, PosesInvalid),
        (16, 0.5, PosesInvalid),
    ],
)
def test_wrong_numbers_are_refused(tmp_path, column, value, error):
    rows = llff_rows()
    rows[2, column] = value
    llff(tmp_path)
    np.save(tmp_path / "poses_bounds.npy", rows)
    with pytest.raises(error):
        check_capture(tmp_path)


@pytest.mark.parametrize(
    "array", [np.zeros((0, 17)), np.zeros((10, 14)), np.zeros(17), np.array([{}]), np.full((10, 17), "a")]
)
def test_other_arrays_are_refused(tmp_path, array):
    llff(tmp_path)
    np.save(tmp_path / "poses_bounds.npy", array)
    with pytest.raises(PosesInvalid):
        check_capture(tmp_path)


@pytest.mark.parametrize("length", [0, 5, 60, 1000])
def test_cut_file_is_refused(tmp_path, length):
    path = llff(tmp_path) / "poses_bounds.npy"
    path.write_bytes(path.read_bytes()[:length])
    with pytest.raises(PosesInvalid):
        check_capture(tmp_path)
