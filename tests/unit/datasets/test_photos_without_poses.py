import numpy as np
import pytest

from core.datasets import photos_without_poses
from tests.unit.datasets.captures import colmap, llff, llff_rows, nerfstudio, synthetic, write_photo


def test_photos_are_named_in_order(tmp_path):
    for name in ("b.JPG", "a.png"):
        write_photo(tmp_path / name, mode="RGB")
    (tmp_path / "K.txt").write_text("2905 0 1416")
    assert photos_without_poses(tmp_path) == [tmp_path / "a.png", tmp_path / "b.JPG"]


@pytest.mark.parametrize("folder", [".", "images", "wrapped/images", "wrapped/photos/left"])
def test_wrapping_folders_are_looked_into(tmp_path, folder):
    write_photo(tmp_path / folder / "a.png")
    assert photos_without_poses(tmp_path) == [tmp_path / folder / "a.png"]


def test_only_images_counts_where_it_is_there_and_masks_never_do(tmp_path):
    for name in ("images/a.png", "masks/a.png", "images/masks/a.png", "preview.png", "__MACOSX/b.png", "images/.c.png"):
        write_photo(tmp_path / name)
    assert photos_without_poses(tmp_path) == [tmp_path / "images/a.png"]


@pytest.mark.parametrize("build", [synthetic, nerfstudio, colmap, llff])
def test_posed_captures_are_none(tmp_path, build):
    build(tmp_path)
    assert photos_without_poses(tmp_path) is None


def test_damaged_poses_are_still_poses(tmp_path):
    write_photo(tmp_path / "images/a.png")
    (tmp_path / "transforms.json").write_text("{")
    assert photos_without_poses(tmp_path) is None


def test_several_captures_are_none(tmp_path):
    synthetic(tmp_path / "a")
    synthetic(tmp_path / "b")
    assert photos_without_poses(tmp_path) is None


def test_nothing_to_pose_is_none(tmp_path):
    assert photos_without_poses(tmp_path) is None
    assert photos_without_poses(tmp_path / "nowhere") is None
    write_photo(tmp_path / "masks/a.png")
    assert photos_without_poses(tmp_path) is None
    write_photo(tmp_path / "a.png")
    assert photos_without_poses(tmp_path / "a.png") is None
    np.save(tmp_path / "poses_bounds.npy", llff_rows())
    assert photos_without_poses(tmp_path) is None
