"""instant-ngp and nerfstudio captures: transforms.json with intrinsics and OpenCV distortion, shared or per frame.

Poses are camera-to-world with OpenGL axes, as ours. A split that the file states (`train_filenames`, `test_filenames`
or `val_filenames`) is used. `aabb_scale` and `applied_transform` do not matter: the capture is normalised. Masks are
read (`mask_path`, or a folder `masks`), depth maps are not.
"""

from __future__ import annotations

from pathlib import Path

from core.datasets.listing import Listing, Photo, held_out, mask_notes
from core.datasets.photo_paths import PhotoFinder, relative_photo_path
from core.datasets.posed_photos import posed_photos
from core.datasets.posefile import PoseFile, read_pose_file

POSE_FILE = "transforms.json"


def list_nerfstudio(pose_path: Path, *, skip_missing: bool = False) -> Listing:
    """The capture's photos, posed and with their headers checked.

    Raises:
        InputError: see `core.datasets.check_capture`.
    """
    poses = read_pose_file(pose_path)
    finder = PhotoFinder(pose_path.parent)
    photos = posed_photos(poses, finder)
    notes = finder.left_out() if skip_missing else finder.check_none_missing()
    return Listing(*_stated_split(poses, photos) or held_out(photos), notes + mask_notes(photos))


def _stated_split(poses: PoseFile, photos: list[Photo]) -> tuple[tuple[Photo, ...], tuple[Photo, ...]] | None:
    """The file's own split, or None where it states no held-out photos."""
    names = poses.texts("test_filenames") or poses.texts("val_filenames")
    if not names:
        return None
    test_names = {relative_photo_path(name) for name in names}
    train_names = poses.texts("train_filenames")
    test = [photo for photo in photos if photo.stated_path in test_names]
    train = [photo for photo in photos if photo.stated_path not in test_names]
    if train_names is not None:
        kept = {relative_photo_path(name) for name in train_names}
        train = [photo for photo in train if photo.stated_path in kept]
    return tuple(train), tuple(test)
