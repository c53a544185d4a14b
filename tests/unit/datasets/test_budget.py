"""How large photos are read when nobody says it: memory is bounded, and the capture's notes tell."""

import numpy as np
import pytest

from core.datasets import budget, check_capture, read_capture
from core.datasets.photo_folders import Reduction
from core.errors import ImageTooLarge
from core.images import area_resized, read_image
from tests.unit.datasets.captures import llff, nerfstudio, synthetic, write_photo

TOTAL = 6 * 8 * 6  # pixels of `synthetic`


def pixels_of(capture) -> int:
    return sum(view.image_u8[..., 0].size for view in capture.train + capture.test)


def test_photos_within_the_budget_are_read_as_they_are(tmp_path):
    capture = read_capture(synthetic(tmp_path), pixel_budget=TOTAL)
    assert pixels_of(capture) == TOTAL
    assert capture.notes == ()


@pytest.mark.parametrize("share", [0.9, 0.5, 0.26, 0.1])
def test_photos_beyond_the_budget_are_reduced_to_it(tmp_path, share):
    synthetic(tmp_path, size=(80, 60))
    allowed = int(share * 100 * TOTAL)
    capture = read_capture(tmp_path, pixel_budget=allowed)
    # Sides are whole pixels, and the factor is looked for in steps of 0.01.
    assert 0.93 * allowed <= pixels_of(capture) <= allowed
    assert len({view.camera.size_px for view in capture.train + capture.test}) == 1
    assert "instead of 80 x 60, so that they fit into memory" in capture.notes[0]
    assert "--max-size-px" in capture.notes[0]


def test_reduced_photos_are_area_averages(tmp_path):
    synthetic(tmp_path, size=(80, 60))
    view = read_capture(tmp_path, pixel_budget=20 * TOTAL).train[2]
    expected = area_resized(read_image(tmp_path / "train/r_2.png"), view.camera.size_px)
    np.testing.assert_array_equal(view.image_u8, expected)


def test_photos_of_unlike_sizes_are_reduced_alike(tmp_path):
    nerfstudio(tmp_path, w=None, h=None)
    for index in range(0, 10, 2):
        write_photo(tmp_path / f"images/{index:04}.png", (80, 60), "RGB")
    capture = read_capture(tmp_path, pixel_budget=5 * 40 * 30 + 5 * 4 * 3)
    assert {view.camera.size_px for view in capture.train + capture.test} == {(40, 30), (4, 3)}


def test_downscaling_further_than_the_budget_is_kept(tmp_path):
    capture = read_capture(synthetic(tmp_path, size=(80, 60)), downscale=8, pixel_budget=50 * TOTAL)
    assert capture.train[0].camera.size_px == (10, 8)
    assert capture.notes == ()


def test_a_size_that_the_user_states_is_kept_and_its_memory_told(tmp_path):
    capture = read_capture(synthetic(tmp_path), max_size_px=8, pixel_budget=TOTAL // 2)
    assert pixels_of(capture) == TOTAL
    assert "GB of memory" in capture.notes[0]


def test_a_single_side_is_bounded_too(tmp_path):
    synthetic(tmp_path, size=(2 * budget.SIDE_BUDGET_PX, 2))
    capture = read_capture(tmp_path)
    assert capture.train[0].camera.size_px == (budget.SIDE_BUDGET_PX, 1)
    assert "fit into memory" in capture.notes[0]


def test_a_smaller_copy_of_the_photos_is_read_where_it_will_do(tmp_path):
    capture = read_capture(llff(tmp_path, photos=("images", "images_4")), pixel_budget=10 * 6 * 5)
    assert capture.train[0].camera.size_px == (6, 5)
    assert capture.notes[0] == "Photos are taken from images_4."
    assert "6 x 5 px instead of 32 x 24" in capture.notes[1]


def test_more_than_anybody_may_ask_for_is_refused_before_decoding(tmp_path, monkeypatch):
    monkeypatch.setattr(budget, "MAX_TOTAL_PIXELS", TOTAL - 1)
    synthetic(tmp_path)
    for path in tmp_path.glob("*/*.png"):
        path.write_bytes(path.read_bytes()[:60])  # headers only
    with pytest.raises(ImageTooLarge, match="6 photos"):
        read_capture(tmp_path, max_size_px=8)


def test_four_hundred_large_photos_fit(tmp_path):
    """By their headers: nothing is decoded."""
    listing = check_capture(synthetic(tmp_path, train=2, test=0, size=(4000, 3000)))
    many = type(listing)(listing.train * 200, ())
    fitted = budget.within_budget(many, Reduction())
    total = budget.total_pixels(many, fitted)
    assert 0.98 * budget.PIXEL_BUDGET < total <= budget.PIXEL_BUDGET
    assert total * budget.BYTES_PER_PIXEL < 2.5 * 2**30  # of 6 GiB
