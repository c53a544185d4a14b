"""Detection, decoding and sizes, whatever the format."""

import shutil
import struct
import zlib

import numpy as np
import pytest
from PIL import Image

from core.datasets import check_capture, read_capture
from core.errors import (
    CaptureEmpty,
    CaptureNotFound,
    ImageTooLarge,
    ImageUndecodable,
    NoImages,
    OptionInvalid,
    PosesMissing,
)
from core.images import area_resized, read_image
from tests.unit.datasets.captures import nerfstudio, synthetic, write_photo


def test_pose_file_itself_is_a_capture(tmp_path):
    synthetic(tmp_path)
    assert len(check_capture(tmp_path / "transforms_train.json").train) == 4
    nerfstudio(tmp_path / "other")
    (tmp_path / "other/transforms.json").rename(tmp_path / "other/poses.json")
    assert len(check_capture(tmp_path / "other/poses.json").photos) == 10


@pytest.mark.parametrize("depth", [1, 2])
def test_wrapping_folders_are_looked_into(tmp_path, depth):
    synthetic(tmp_path.joinpath(*["wrapped"] * depth))
    (tmp_path / "__MACOSX/train").mkdir(parents=True)
    (tmp_path / ".git").mkdir()
    assert len(check_capture(tmp_path).train) == 4


def test_two_captures_in_one_folder_are_refused(tmp_path):
    synthetic(tmp_path / "a")
    synthetic(tmp_path / "b")
    with pytest.raises(PosesMissing, match="2 captures"):
        check_capture(tmp_path)


def test_no_such_folder(tmp_path):
    with pytest.raises(CaptureNotFound, match="nowhere"):
        check_capture(tmp_path / "nowhere")


def test_a_photo_is_not_a_capture(tmp_path):
    write_photo(tmp_path / "photo.png")
    with pytest.raises(CaptureNotFound, match=r"photo\.png"):
        check_capture(tmp_path / "photo.png")


@pytest.mark.parametrize("build", [synthetic, nerfstudio])
def test_capture_without_photos_is_refused(tmp_path, build):
    build(tmp_path)
    for folder in ("train", "test", "images"):
        shutil.rmtree(tmp_path / folder, ignore_errors=True)
    with pytest.raises(NoImages):
        check_capture(tmp_path)


def test_empty_folder_is_refused(tmp_path):
    with pytest.raises(NoImages):
        check_capture(tmp_path)


def test_photos_without_poses_are_refused(tmp_path):
    write_photo(tmp_path / "images/1.png")
    with pytest.raises(PosesMissing, match="photos only"):
        check_capture(tmp_path)


def test_all_formats_are_named_where_poses_are_missing(tmp_path):
    write_photo(tmp_path / "images/1.png")
    with pytest.raises(PosesMissing, match=r"(?s)NeRF-synthetic.*nerfstudio.*COLMAP.*LLFF"):
        check_capture(tmp_path)


def test_text_called_png_is_refused_before_decoding(tmp_path):
    synthetic(tmp_path)
    (tmp_path / "train/r_1.png").write_text("hello")
    with pytest.raises(ImageUndecodable, match=r"train/r_1\.png"):
        check_capture(tmp_path)


def test_huge_photo_is_refused_before_decoding(tmp_path):
    synthetic(tmp_path)

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    header = chunk(b"IHDR", struct.pack(">IIBBBBB", 20_000, 20_000, 8, 6, 0, 0, 0))
    (tmp_path / "train/r_1.png").write_bytes(b"\x89PNG\r\n\x1a\n" + header + chunk(b"IDAT", b"") + chunk(b"IEND", b""))
    with pytest.raises(ImageTooLarge, match=r"train/r_1\.png"):
        check_capture(tmp_path)


def test_truncated_photo_is_refused_when_read(tmp_path):
    synthetic(tmp_path, size=(64, 64))
    path = tmp_path / "test/r_0.png"
    Image.fromarray(np.random.default_rng(0).integers(0, 256, (64, 64, 4), np.uint8)).save(path)
    path.write_bytes(path.read_bytes()[:3000])
    check_capture(tmp_path)
    with pytest.raises(ImageUndecodable, match=r"test/r_0\.png"):
        read_capture(tmp_path)


def test_transparent_photos_are_refused(tmp_path):
    synthetic(tmp_path)
    for path in (tmp_path / "train").iterdir():
        write_photo(path, colour=(255, 255, 255, 0))
    with pytest.raises(CaptureEmpty):
        read_capture(tmp_path)


def test_alpha_that_is_opaque_everywhere_is_dropped(tmp_path):
    capture = read_capture(nerfstudio(tmp_path / "opaque", mode="RGBA"))
    assert capture.has_alpha
    for path in (tmp_path / "opaque/images").iterdir():
        write_photo(path, colour=(10, 20, 30, 255))
    capture = read_capture(tmp_path / "opaque")
    assert not capture.has_alpha
    assert capture.train[0].image_u8.shape == (6, 8, 3)


@pytest.mark.parametrize(
    ("options", "size"),
    [
        ({}, (60, 45)),
        ({"downscale": 3}, (20, 15)),
        ({"max_size_px": 20}, (20, 15)),
        ({"max_size_px": 100}, (60, 45)),
        ({"downscale": 2, "max_size_px": 20}, (20, 15)),
        ({"downscale": 4, "max_size_px": 20}, (15, 11)),
        ({"downscale": 100}, (1, 1)),
    ],
)
def test_photos_and_cameras_are_scaled_together(tmp_path, options, size):
    view = read_capture(synthetic(tmp_path, size=(60, 45)), **options).train[0]
    assert view.camera.size_px == size
    assert view.image_u8.shape == (size[1], size[0], 4)
    # The field of view stays: the focal length scales with each side.
    assert view.camera.focal_px == pytest.approx(
        (size[0] * 0.5 / np.tan(0.345), size[1] * 60 / 45 * 0.5 / np.tan(0.345))
    )


def test_photos_are_area_averages(tmp_path):
    synthetic(tmp_path, size=(12, 10))
    noise = np.random.default_rng(0).integers(0, 256, (10, 12, 4), np.uint8)
    Image.fromarray(noise).save(tmp_path / "train/r_2.png")
    np.testing.assert_array_equal(read_capture(tmp_path, downscale=2).train[2].image_u8, area_resized(noise, (6, 5)))
    np.testing.assert_array_equal(read_image(tmp_path / "train/r_2.png"), noise)


def test_background_is_kept(tmp_path):
    assert read_capture(synthetic(tmp_path), background=(0.0, 0.5, 1.0)).background == (0.0, 0.5, 1.0)


@pytest.mark.parametrize("options", [{"downscale": 0}, {"downscale": 0.5}, {"max_size_px": 0}])
def test_sizes_below_one_are_refused(tmp_path, options):
    with pytest.raises(OptionInvalid):
        read_capture(synthetic(tmp_path), **options)


def test_messages_do_not_show_the_folder(tmp_path):
    synthetic(tmp_path)
    (tmp_path / "train/r_1.png").write_text("hello")
    with pytest.raises(ImageUndecodable) as caught:
        check_capture(tmp_path)
    assert str(tmp_path) not in str(caught.value)
