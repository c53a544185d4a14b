"""NeRF-synthetic captures: transforms_train.json, transforms_test.json, one horizontal field of view for all.

`transforms_val.json` is ignored: it is for tuning. Paths lack their suffix (`./train/r_0`). Photos are RGBA, and as one
angle describes them all, they must have one size.
"""

from __future__ import annotations

from pathlib import Path

from core.datasets.listing import Listing, Photo, held_out
from core.datasets.photo_paths import PhotoFinder
from core.datasets.posed_photos import posed_photos
from core.datasets.posefile import read_pose_file
from core.errors import ImageSizeMismatch

TRAIN_FILE = "transforms_train.json"
TEST_FILE = "transforms_test.json"


def list_nerf_synthetic(folder: Path, *, skip_missing: bool = False) -> Listing:
    """The capture's photos, posed and with their headers checked; without a test file every 8th photo is held out.

    Raises:
        InputError: see `core.datasets.check_capture`.
    """
    finder = PhotoFinder(folder)
    train = posed_photos(read_pose_file(folder / TRAIN_FILE), finder)
    has_test = (folder / TEST_FILE).is_file()
    test = posed_photos(read_pose_file(folder / TEST_FILE), finder) if has_test else []
    notes = finder.left_out() if skip_missing else finder.check_none_missing()
    _check_one_size(train + test)
    return Listing(tuple(train), tuple(test), notes) if has_test else Listing(*held_out(train), notes)


def _check_one_size(photos: list[Photo]) -> None:
    for photo in photos:
        if photo.lens.size_px != photos[0].lens.size_px:
            raise ImageSizeMismatch(
                f"photo {photo.name}",
                "must have the size of the others, since the pose file gives one field of view for all",
                f"{photo.lens.size_px[0]} x {photo.lens.size_px[1]} px, and {photos[0].name} has "
                f"{photos[0].lens.size_px[0]} x {photos[0].lens.size_px[1]} px",
                "Render or scale all photos to one size.",
            )
