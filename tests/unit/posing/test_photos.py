"""What is known of photos before COLMAP sees them: which there are, their lenses, which way is up."""

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from core.posing.headers import read_headers
from core.posing.lenses import shared_lenses
from core.posing.photo_set import find_photo_set
from core.posing.workspace import Workspace, identity_of

MAKE, MODEL, ORIENTATION, EXIF, FOCAL_35MM = 0x010F, 0x0110, 0x0112, 0x8769, 0xA405


def write(path: Path, size: tuple[int, int] = (60, 40), **tags: object) -> None:
    exif = Image.Exif()
    for name, tag in (("model", MODEL), ("orientation", ORIENTATION)):
        if name in tags:
            exif[tag] = tags[name]
    if "focal" in tags:
        exif.get_ifd(EXIF)[FOCAL_35MM] = tags["focal"]
    path.parent.mkdir(parents=True, exist_ok=True)
    ramp = np.linspace(0, 255, size[0] * size[1] * 3).reshape(size[1], size[0], 3).astype(np.uint8)
    Image.fromarray(ramp).save(path, exif=exif)


def lenses(folder: Path) -> list:
    photos = find_photo_set(folder)
    return shared_lenses(photos, read_headers(photos))


def test_photos_of_one_camera_share_a_lens_with_the_stated_focal_length(tmp_path: Path) -> None:
    for index in range(4):
        write(tmp_path / f"{index}.jpg", model="A", focal=36)
    (lens,) = lenses(tmp_path)
    assert lens.names == ("0.jpg", "1.jpg", "2.jpg", "3.jpg")
    assert lens.focal_known
    assert lens.focal_px == pytest.approx(36 / np.hypot(36, 24) * np.hypot(60, 40))


def test_other_zoom_size_or_camera_is_another_lens(tmp_path: Path) -> None:
    write(tmp_path / "0.jpg", model="A", focal=36)
    write(tmp_path / "1.jpg", model="A", focal=50)
    write(tmp_path / "2.jpg", model="B", focal=36)
    write(tmp_path / "3.jpg", model="A", focal=36, size=(40, 30))
    assert [lens.names for lens in lenses(tmp_path)] == [("0.jpg",), ("1.jpg",), ("2.jpg",), ("3.jpg",)]


def test_photos_that_tell_nothing_get_a_guess(tmp_path: Path) -> None:
    for index in range(3):
        write(tmp_path / f"{index}.png")
    (lens,) = lenses(tmp_path)
    assert (lens.focal_known, lens.focal_px) == (False, 1.2 * 60)


def test_distortion_is_estimated_as_far_as_the_photos_tell(tmp_path: Path) -> None:
    for index in range(12):
        write(tmp_path / f"{index}.png", size=(60, 40) if index < 10 else (40, 60))
    assert [lens.model for lens in lenses(tmp_path)] == ["OPENCV", "SIMPLE_RADIAL"]


def test_sideways_photos_are_copied_upright_and_others_linked(tmp_path: Path) -> None:
    for index, orientation in enumerate((1, 6, 8)):
        write(tmp_path / "photos" / f"{index}.jpg", orientation=orientation)
    photos = find_photo_set(tmp_path / "photos")
    headers = read_headers(photos)
    workspace = Workspace(tmp_path / "work")
    workspace.link_photos(photos, headers)
    assert [header.size_px for header in headers.values()] == [(60, 40), (40, 60), (40, 60)]
    for name, header in headers.items():
        assert Image.open(workspace.images / name).size == header.size_px
    assert (workspace.images / "0.jpg").is_symlink()
    assert not (workspace.images / "1.jpg").is_symlink()


def test_work_for_other_photos_is_thrown_away(tmp_path: Path) -> None:
    for index in range(3):
        write(tmp_path / "photos" / f"{index}.png")
    workspace = Workspace(tmp_path / "work")
    photos = find_photo_set(tmp_path / "photos")
    workspace.claim(identity_of(photos, seed=0))
    workspace.database.write_text("features")
    workspace.claim(identity_of(photos, seed=0))
    assert workspace.database.exists()
    write(tmp_path / "photos" / "1.png", size=(64, 40))
    workspace.claim(identity_of(find_photo_set(tmp_path / "photos"), seed=0))
    assert not workspace.database.exists()


def test_masks_and_results_are_not_photos(tmp_path: Path) -> None:
    for index in range(3):
        write(tmp_path / f"{index}.png")
        write(tmp_path / "masks" / f"{index}.png")
        write(tmp_path / "depth" / f"{index}.png")
        write(tmp_path / "out" / f"{index}.png")
    photos = find_photo_set(tmp_path, without=tmp_path / "out")
    assert photos.names == ("0.png", "1.png", "2.png")
    assert photos.masks == tmp_path / "masks"


def test_masks_beside_the_photos_are_linked_for_the_reader(tmp_path: Path) -> None:
    for index in range(3):
        write(tmp_path / "capture" / "images" / f"{index}.png")
        write(tmp_path / "capture" / "masks" / f"{index}.png.png")
    photos = find_photo_set(tmp_path)
    workspace = Workspace(tmp_path / "work")
    workspace.claim(identity_of(photos))
    workspace.link_photos(photos, read_headers(photos))
    assert (workspace.folder / "masks" / "2.png.png").is_file()
