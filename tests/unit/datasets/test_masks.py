"""What is black in a mask is left out, however the photo is undistorted and made smaller: never less, hardly more."""

from pathlib import PurePosixPath

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import Image

from core.datasets import check_capture, read_capture
from core.datasets.distortion import NO_DISTORTION, Distortion
from core.datasets.lens import Lens
from core.datasets.masks import find_mask, read_mask
from core.datasets.undistortion import undistorted
from core.errors import CaptureEmpty, ImageMissing, ImageSizeMismatch, ImageUndecodable
from tests.unit.datasets.captures import change_frame, colmap, llff, nerfstudio

SIZE = (40, 30)
LENSES = [NO_DISTORTION, Distortion(k1=-0.1, p1=0.01), Distortion(k1=0.05, fisheye=True)]


def save(path, black):
    path.parent.mkdir(parents=True, exist_ok=True)
    Image.fromarray(np.where(black, 0, 255).astype(np.uint8)).save(path)
    return path


def lens_with(distortion):
    return Lens((50.0, 50.0), (20.0, 15.0), SIZE, distortion)


def spots(seed, share=0.03):
    return np.random.default_rng(seed).random(SIZE[::-1]) < share


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 1000), st.sampled_from(LENSES), st.integers(3, 40), st.integers(3, 30))
def test_no_kept_pixel_shows_anything_black(tmp_path_factory, seed, distortion, width, height):
    lens, black = lens_with(distortion), spots(seed)
    path = save(tmp_path_factory.mktemp("mask") / "mask.png", black)
    size = (min(width, lens.pinhole.size_px[0]), min(height, lens.pinhole.size_px[1]))
    ignored = read_mask(path, "photo", lens, size)
    assert ignored.shape == size[::-1]
    # The oracle: a float picture that is 1 where the mask is black, undistorted and averaged over every new pixel.
    shown = undistorted(np.repeat((black * 255).astype(np.uint8)[..., None], 3, 2), lens)[..., 0] > 0
    for y, x in np.argwhere(~ignored):
        top, bottom = y * shown.shape[0] / size[1], (y + 1) * shown.shape[0] / size[1]
        left, right = x * shown.shape[1] / size[0], (x + 1) * shown.shape[1] / size[0]
        rows = slice(int(top + 1e-9), int(np.ceil(bottom - 1e-9)))
        assert not shown[rows, int(left + 1e-9) : int(np.ceil(right - 1e-9))].any()


@pytest.mark.parametrize("distortion", LENSES)
def test_masks_grow_by_less_than_two_pixels(tmp_path, distortion):
    lens = lens_with(distortion)
    black = np.zeros(SIZE[::-1], bool)
    black[10:20, 12:24] = True
    ignored = read_mask(save(tmp_path / "mask.png", black), "photo", lens, lens.pinhole.size_px)
    near = np.zeros_like(black)
    near[8:22, 10:26] = True
    near = undistorted(np.repeat((near * 255).astype(np.uint8)[..., None], 3, 2), lens)[..., 0] > 0
    assert ignored.any()
    assert not (ignored & ~near).any()


@pytest.mark.parametrize("levels", [(0, 255), (0, 1), (3, 250), (90, 200)])
def test_black_is_darker_than_half_of_the_brightest(tmp_path, levels):
    black = spots(1)
    Image.fromarray(np.where(black, *levels).astype(np.uint8)).save(tmp_path / "mask.png")
    np.testing.assert_array_equal(read_mask(tmp_path / "mask.png", "photo", lens_with(NO_DISTORTION), SIZE), black)


@pytest.mark.parametrize("factor", [0.5, 2, 3])
def test_mask_may_have_another_scale(tmp_path, factor):
    black = np.zeros((round(30 * factor), round(40 * factor)), bool)
    black[: len(black) // 3] = True
    ignored = read_mask(save(tmp_path / "mask.png", black), "photo", lens_with(NO_DISTORTION), SIZE)
    np.testing.assert_array_equal(ignored, np.arange(30)[:, None].repeat(40, 1) < 10)


def test_mask_of_another_shape_is_refused(tmp_path):
    path = save(tmp_path / "mask.png", np.zeros((40, 30), bool))
    with pytest.raises(ImageSizeMismatch, match="mask of photo"):
        read_mask(path, "photo", lens_with(NO_DISTORTION), SIZE)


@pytest.mark.parametrize("name", ["a/0001.jpg.png", "a/0001.png", "a/0001.jpg"])
def test_usual_names_of_a_mask(tmp_path, name):
    path = save(tmp_path / name, spots(0))
    assert find_mask(tmp_path, PurePosixPath("a/0001.jpg")) == path
    assert find_mask(tmp_path, PurePosixPath("a/0002.jpg")) is None


@pytest.mark.parametrize("build", [nerfstudio, colmap, lambda folder: llff(folder, photos=("images",))])
@pytest.mark.parametrize("suffix", [".png.png", ".png"])
def test_masks_beside_images_are_used(tmp_path, build, suffix):
    photo = next(photo for photo in check_capture(build(tmp_path)).train if "1" in photo.camera.name)
    width, height = photo.lens.size_px
    black = np.zeros((height, width), bool)
    black[0, :3] = True
    save(tmp_path / f"masks/{photo.camera.name}{suffix}", black)
    capture = read_capture(tmp_path)
    views = {view.camera.name: view for view in capture.train}
    np.testing.assert_array_equal(views.pop(photo.camera.name).ignored, black)
    assert all(view.ignored is None for view in views.values())
    assert "Masks of 1 of 10 photos are used: what they show black is left out." in capture.notes


def test_mask_path_of_a_frame_is_used(tmp_path):
    change_frame(nerfstudio(tmp_path), 3, mask_path="cuts/three.png")
    save(tmp_path / "cuts/three.png", np.arange(48).reshape(6, 8) < 5)
    views = {view.camera.name: view for view in read_capture(tmp_path).train}
    assert views["0003"].ignored.sum() == 5


def test_mask_that_a_frame_names_must_be_there(tmp_path):
    change_frame(nerfstudio(tmp_path), 3, mask_path="cuts/three.png")
    with pytest.raises(ImageMissing, match=r"cuts/three\.png"):
        check_capture(tmp_path)


@pytest.mark.parametrize("name", ["../three.png", "/three.png"])
def test_mask_must_lie_within_the_capture(tmp_path, name):
    save(tmp_path / "three.png", np.zeros((6, 8), bool))
    change_frame(nerfstudio(tmp_path / "capture"), 3, mask_path=name)
    with pytest.raises(ImageMissing, match="inside the capture"):
        check_capture(tmp_path / "capture")


def test_damaged_mask_is_refused(tmp_path):
    nerfstudio(tmp_path)
    (tmp_path / "masks").mkdir()
    (tmp_path / "masks/0001.png").write_text("hello")
    with pytest.raises(ImageUndecodable):
        read_capture(tmp_path)


def test_black_masks_throughout_are_refused(tmp_path):
    nerfstudio(tmp_path)
    for index in range(10):
        save(tmp_path / f"masks/{index:04}.png", np.ones((6, 8), bool))
    with pytest.raises(CaptureEmpty, match="black is left out"):
        read_capture(tmp_path)


def test_alpha_is_not_a_mask(tmp_path):
    assert all(view.ignored is None for view in read_capture(nerfstudio(tmp_path, mode="RGBA")).train)
