"""Published captures, where they are at hand: POLYFIELD_DATA, or ../shared/data beside the repository."""

import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from core.datasets import Listing, check_capture, photos_without_poses, read_capture
from core.datasets.decode import decoded
from core.datasets.photo_folders import Reduction
from core.errors import ImageMissing, PosesMissing
from core.scene_kind import FORWARD, OBJECT, UNBOUNDED

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
    assert capture.kind.name == OBJECT
    assert np.cbrt(np.linalg.det(capture.user_from_object[:3, :3])) == pytest.approx(4.03, abs=0.01)
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


@pytest.mark.parametrize(("path", "size"), [("fern", (504, 378)), ("fern/images_8", (504, 378))])
def test_fern_is_forward_facing(path, size):
    capture_folder("fern")
    capture = read_capture(DATA / path, downscale=8 if path == "fern" else 1)
    assert (len(capture.train), len(capture.test)) == (17, 3)
    assert [view.camera.name for view in capture.test] == ["image000", "image008", "image016"]
    assert capture.kind.name == FORWARD
    # Focal length by the pose file: 3260.5 px at 4032 px.
    assert capture.train[0].camera.size_px == size
    assert capture.train[0].camera.focal_px == pytest.approx((3260.526 / 8,) * 2, abs=1e-2)
    near = min(view.depth_range[0] for view in capture.train)
    far = max(view.depth_range[1] for view in capture.train)
    assert 0.3 < near < 1 < far < 5  # object units: what is looked at is at 1


def test_fox_is_unbounded():
    capture = read_capture(capture_folder("fox"), skip_missing=True, max_size_px=60)
    assert capture.kind.name == UNBOUNDED


def test_sceaux_is_photos_only():
    assert len(photos_without_poses(capture_folder("sceaux_unposed"))) == 11
    with pytest.raises(PosesMissing, match="photos only"):
        check_capture(capture_folder("sceaux_unposed"))


def shortened(listing: Listing) -> Listing:
    return replace(listing, train=listing.train[:3], test=listing.test[:1])
