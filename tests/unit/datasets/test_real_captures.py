"""Published captures, where they are at hand: POLYFIELD_DATA, or ../shared/data beside the repository."""

import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from core.datasets import Listing, check_capture, read_capture
from core.datasets.decode import decoded
from core.datasets.photo_folders import Reduction
from core.errors import ImageMissing

DATA = Path(os.environ.get("POLYFIELD_DATA", Path(__file__).parents[4] / "shared/data"))


def capture_folder(name: str) -> Path:
    folder = DATA / name
    if not folder.is_dir():
        pytest.skip(f"{folder} is not there; set POLYFIELD_DATA to a folder with {name}")
    return folder


def test_lego_is_read_whole():
    capture = read_capture(capture_folder("lego_100"))
    assert (len(capture.train), len(capture.test)) == (100, 25)
    assert capture.has_alpha
    assert capture.train[0].camera.focal_px == pytest.approx((138.8889,) * 2, abs=1e-3)


def test_lego_scaled_down_equals_the_published_scale():
    few = [shortened(check_capture(capture_folder(name))) for name in ("lego_400", "lego_100")]
    (ours, _), (theirs, _) = decoded(few[0], Reduction(4)), decoded(few[1])
    for our, their in zip(ours, theirs, strict=True):
        # Both went through 8 bits twice; straight colours at thin alpha round coarsely, but hardly show.
        assert np.abs(our.over((1, 1, 1)) - their.over((1, 1, 1))).max() < 3 / 255


def test_fox_names_photos_that_it_lacks():
    with pytest.raises(ImageMissing, match="17 missing"):
        check_capture(capture_folder("fox"))


def test_fox_is_undistorted():
    listing = check_capture(capture_folder("fox"), skip_missing=True)
    assert (len(listing.train), len(listing.test)) == (43, 7)
    assert "17 photos" in listing.notes[0]
    camera = decoded(shortened(listing), Reduction(max_size_px=120))[0][0].camera
    # A mild lens: the pinhole photo keeps the field of view to within a few percent.
    assert 2 * np.arctan(camera.size_px[0] / 2 / camera.focal_px[0]) == pytest.approx(0.748, rel=0.05)


def shortened(listing: Listing) -> Listing:
    return replace(listing, train=listing.train[:3], test=listing.test[:1])
