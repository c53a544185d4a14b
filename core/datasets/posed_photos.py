"""The frames of a pose file as posed photos."""

from __future__ import annotations

from pathlib import Path, PurePosixPath

import numpy as np

from core.camera import Camera
from core.datasets.intrinsics import lens_of
from core.datasets.lens import Lens
from core.datasets.listing import Photo
from core.datasets.masks import FOLDER, find_mask
from core.datasets.photo_paths import PhotoFinder, relative_photo_path
from core.datasets.posefile import PoseFile
from core.errors import ImageMissing
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
    stated_path = relative_photo_path(file_path)
    mask_path = _mask(frame, stated_path, folder)
    return Photo(path, name, stated_path, pinhole_camera(path.stem, frame.matrix(), lens), lens, mask_path)


def pinhole_camera(name: str, world_from_camera: np.ndarray, lens: Lens) -> Camera:
    """The camera of a photo once it is undistorted.

    Raises:
        PosesInvalid, PoseNotFinite, PoseNotRigid
    """
    pinhole = lens.pinhole
    return Camera(name, world_from_camera, pinhole.focal_px, pinhole.centre_px, pinhole.size_px)


def _mask(frame: PoseFile, photo: PurePosixPath, folder: Path) -> Path | None:
    """The mask that the frame names, else the one that lies in masks/."""
    stated = frame.text("mask_path")
    if stated is None:
        return find_mask(folder / FOLDER, PurePosixPath(*photo.parts[1:]) if len(photo.parts) > 1 else photo)
    relative = relative_photo_path(stated)
    path = next((path for path in (folder / relative, folder / relative.name) if path.is_file()), None)
    if path is None:
        raise ImageMissing(
            f"mask of {photo}",
            "must be there, since the pose file names it",
            f"no {stated[:80]}",
            'Add the mask, or remove "mask_path" from the pose file.',
        )
    return path
