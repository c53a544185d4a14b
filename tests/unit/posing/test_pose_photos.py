"""Photos of a room's corner whose cameras we know, with photos among them that cannot be posed."""

import hashlib
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from core.camera import Camera
from core.datasets import read_capture
from core.errors import NoImages, PosesNotFound, PosingFailed, TooFewImages
from core.posing import pose_photos as module
from core.posing.pose_photos import pose_photos
from core.posing.posing import Posing
from core.progress import Progress
from tests.unit.posing import room

BLANK, NOISE, TEXT = "blank wall.png", "somewhere else.png", "text.png"


@pytest.fixture(scope="module")
def cameras() -> list[Camera]:
    return room.arc(8)


@pytest.fixture(scope="module")
def photos(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder as people have it: photos in a subfolder, one with a blank in its name, and notes beside them."""
    folder = tmp_path_factory.mktemp("room")
    images = folder / "images"
    room.write_photos(images)
    (images / "3.png").rename(images / "3 (copy).png")
    Image.new("RGB", room.SIZE_PX, (200, 205, 210)).save(images / BLANK)
    noise = np.random.default_rng(0).integers(0, 256, (24, 32, 3), np.uint8)
    Image.fromarray(noise).resize(room.SIZE_PX, Image.Resampling.BICUBIC).save(images / NOISE)
    (images / TEXT).write_text("no photo")
    (images / "K.txt").write_text("330 0 160\n0 330 120\n0 0 1\n")
    return folder


@pytest.fixture(scope="module")
def reports() -> list[Progress]:
    return []


@pytest.fixture(scope="module")
def posing(photos: Path, reports: list[Progress], tmp_path_factory: pytest.TempPathFactory) -> Posing:
    return pose_photos(photos, tmp_path_factory.mktemp("work") / "posing", progress=reports.append)


def test_all_photos_of_the_room_are_posed(posing: Posing) -> None:
    assert posing.registered == ("0.png", "1.png", "2.png", "3 (copy).png", "4.png", "5.png", "6.png", "7.png")
    assert posing.cameras == 1
    assert posing.points > 500
    assert posing.error_px < 0.5  # rendered without noise; 0.11 here
    posing.require_usable()


def test_photos_that_are_left_out_have_reasons(posing: Posing) -> None:
    reasons = {photo.name: photo.reason for photo in posing.left_out}
    assert set(reasons) == {BLANK, NOISE, TEXT}
    assert "hardly any detail" in reasons[BLANK]
    assert "match" in reasons[NOISE]
    assert "cannot be read" in reasons[TEXT]
    assert posing.summary.startswith("8 of 11 photos posed: ")


def test_cameras_agree_with_the_true_ones_up_to_a_similarity(posing: Posing, cameras: list[Camera]) -> None:
    capture = read_capture(posing.folder)
    found = {view.camera.name[0]: view.camera for view in (*capture.train, *capture.test)}
    estimated = [found[camera.name] for camera in cameras]
    rotation, error = aligned([c.position for c in estimated], [c.position for c in cameras])
    assert error < 0.01  # of the cameras' spread; focal length and distortion are estimated, too
    for one, true in zip(estimated, cameras, strict=True):
        turn = rotation @ one.world_from_camera[:3, :3] @ true.world_from_camera[:3, :3].T
        assert np.degrees(np.arccos(np.clip((np.trace(turn) - 1) / 2, -1, 1))) < 0.5
        assert one.focal_px[0] == pytest.approx(true.focal_px[0], rel=0.02)


def test_model_is_read_as_a_capture_with_points(posing: Posing) -> None:
    capture = read_capture(posing.folder)
    assert capture.points is not None
    assert len(capture.points) > 100
    assert len(capture.train) + len(capture.test) == 8


def test_progress_names_the_stages_and_never_falls(posing: Posing, reports: list[Progress]) -> None:
    assert list(dict.fromkeys(report.stage for report in reports)) == ["features", "matching", "mapping"]
    fractions = [report.fraction for report in reports]
    assert fractions == sorted(fractions)
    assert fractions[-1] <= 1.0
    assert len(fractions) > 15


def test_finished_posing_is_not_done_again(posing: Posing, photos: Path) -> None:
    again: list[Progress] = []
    assert pose_photos(photos, posing.folder, progress=again.append) == posing
    assert again == []


def test_photos_that_moved_are_linked_anew(posing: Posing, photos: Path, tmp_path: Path) -> None:
    moved = photos.rename(tmp_path / "moved")
    try:
        assert pose_photos(moved, posing.folder).registered == posing.registered
        assert len(read_capture(posing.folder).train) > 0
    finally:
        moved.rename(photos)
        pose_photos(photos, posing.folder)


def test_interrupted_posing_goes_on_and_gives_the_same_bytes(tmp_path: Path) -> None:
    room.write_photos(tmp_path / "photos", count=5)
    whole = pose_photos(tmp_path / "photos", tmp_path / "whole")

    class Stopped(Exception):
        pass

    def stop(report: Progress) -> None:
        if report.stage == "matching":
            raise Stopped

    with pytest.raises(Stopped):
        pose_photos(tmp_path / "photos", tmp_path / "resumed", progress=stop)
    later: list[Progress] = []
    resumed = pose_photos(tmp_path / "photos", tmp_path / "resumed", progress=later.append)
    assert sum(report.stage == "features" for report in later) == 1  # its start alone: they were kept
    assert model_digest(resumed) == model_digest(whole)


def test_blank_photos_are_refused_with_names(tmp_path: Path) -> None:
    for index in range(4):
        Image.new("RGB", (160, 120), (180, 180, 180 + index)).save(tmp_path / f"{index}.png")
    posing = pose_photos(tmp_path, tmp_path / "out" / "posing")
    assert (posing.registered, posing.is_usable) == ((), False)
    with pytest.raises(PosesNotFound, match=r"0 of 4 photos.*hardly any detail.*0\.png") as error:
        posing.require_usable()
    assert error.value.code == "poses-not-found"


def test_two_photos_are_too_few(tmp_path: Path) -> None:
    room.write_photos(tmp_path, count=2)
    with pytest.raises(TooFewImages, match="at least 3"):
        pose_photos(tmp_path, tmp_path / "out" / "posing")
    assert not (tmp_path / "out").exists()


def test_folder_without_photos_is_refused(tmp_path: Path) -> None:
    with pytest.raises(NoImages):
        pose_photos(tmp_path, tmp_path / "posing")


def test_crashes_are_retried_and_then_reported(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    room.write_photos(tmp_path, count=3)
    tries: list[int] = []
    monkeypatch.setattr(module, "_run_child", lambda *_: tries.append(1) or "exit status -6: Check failed")
    with pytest.raises(PosingFailed, match="Check failed"):
        pose_photos(tmp_path, tmp_path / "posing")
    assert len(tries) == module.ATTEMPTS


def aligned(estimated: list[np.ndarray], true: list[np.ndarray]) -> tuple[np.ndarray, float]:
    """(rotation [3, 3], largest error over the spread) of the best similarity between points (Umeyama 1991)."""
    a, b = np.array(estimated), np.array(true)
    a0, b0 = a - a.mean(0), b - b.mean(0)
    u, s, vt = np.linalg.svd(b0.T @ a0)
    flip = np.diag([1.0, 1.0, np.sign(np.linalg.det(u @ vt))])
    rotation = u @ flip @ vt
    scale = (s * flip.diagonal()).sum() / (a0**2).sum()
    error = np.linalg.norm(b0 - scale * a0 @ rotation.T, axis=1).max()
    return rotation, float(error / np.linalg.norm(b0, axis=1).max())


def model_digest(posing: Posing) -> list[str]:
    files = sorted((posing.folder / "sparse" / "0").iterdir())
    return [hashlib.sha256(file.read_bytes()).hexdigest() for file in files]
