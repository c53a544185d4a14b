"""The frames of a pose file as posed photos."""

from __future__ import annotations

from pathlib import Path

from core.camera import Camera
from core.datasets.intrinsics import lens_of
from core.datasets.listing import Photo
from core.datasets.photo_paths import PhotoFinder, relative_photo_path
from core.datasets.posefile import PoseFile
from core.images import read_size


def posed_photos(poses: PoseFile, finder: PhotoFinder) -> list[Photo]:
    """Every frame whose photo exists, in the file's order; the finder notes the others.

    Cheap checks of all frames go first (types, finite and rigid poses), then existence, then photo headers.

    Raises:
        PosesInvalid, PoseNotFinite, PoseNotRigid, ImageMissing, ImageUndecodable, ImageTooLarge, ImageSizeMismatch
    """
    frames = poses.frames()
    stated = [_checked_path(frame) for frame in frames]
    for frame, file_path in zip(frames, stated, strict=True):
        _camera(frame, file_path)
    paths = [finder.find(file_path) for file_path in stated]
    return [
        _photo(poses, frame, file_path, path, finder.folder)
        for frame, file_path, path in zip(frames, stated, paths, strict=True)
        if path is not None
    ]


def _checked_path(frame: PoseFile) -> str:
    file_path = frame.text("file_path")
    if file_path is None:
        raise frame.invalid('"file_path" must name the photo', None)
    relative_photo_path(file_path)
    return file_path


def _camera(frame: PoseFile, file_path: str) -> Camera:
    """The pose alone, with a lens of no meaning: it may be wrong before any photo is opened."""
    return Camera(relative_photo_path(file_path).stem, frame.matrix(), (1.0, 1.0), (0.5, 0.5), (1, 1))


def _photo(poses: PoseFile, frame: PoseFile, file_path: str, path: Path, folder: Path) -> Photo:
    name = path.relative_to(folder).as_posix()
    lens = lens_of(poses, frame, read_size(path, name), name)
    pinhole = lens.pinhole
    camera = Camera(path.stem, frame.matrix(), pinhole.focal_px, pinhole.centre_px, pinhole.size_px)
    return Photo(path, name, relative_photo_path(file_path), camera, lens)
