"""LLFF captures: poses_bounds.npy, and photos in `images` or a smaller copy of it.

The file has a row of 17 numbers per photo, in the order of the photos' names: a 3 x 5 matrix by rows, whose columns are
the camera's axes (down, right, backwards), its position, and (height, width, focal length in pixels) of the photo in
full size; then the depths of the nearest and the farthest point (github.com/Fyusion/LLFF, "Using your own poses").
Pixels are square, the centre is the middle. The frame is arbitrary.
"""

from __future__ import annotations

from pathlib import Path, PurePosixPath

import numpy as np

from core.datasets.lens import Lens
from core.datasets.listing import Listing, Photo, held_out, mask_notes
from core.datasets.masks import FOLDER, find_mask
from core.datasets.photo_folders import PhotoFolder, Reduction, chosen_folder, photos_in
from core.datasets.posed_photos import pinhole_camera
from core.datasets.scaled_lens import of_stored_size
from core.errors import NoImages, PoseNotFinite, PosesInvalid
from core.images import read_size

POSE_FILE = "poses_bounds.npy"
COLUMNS = 17
MAX_BYTES = 16 << 20  # about 100,000 photos
REMEDY = "Write the file again with LLFF's imgs2poses.py, for exactly these photos."


def list_llff(pose_path: Path, reduction: Reduction, photo_folder: Path | None = None) -> Listing:
    """The capture's photos, posed and with their headers checked; every 8th is held out.

    Args:
        reduction: decides which of several folders of photos is taken.
        photo_folder: the folder to take, if the user named one.

    Raises:
        InputError: see `core.datasets.check_capture`.
    """
    rows = _read_rows(pose_path)
    root = pose_path.parent
    full_size = _size(rows[0, :15].reshape(3, 5))
    folder = PhotoFolder(photo_folder) if photo_folder else chosen_folder(root, full_size, reduction, _has_photos)
    paths = photos_in(folder.path)
    if not paths:
        raise NoImages("capture", f"must have photos beside {POSE_FILE}, or in images", "none", "Add the photos.")
    if len(paths) != len(rows):
        raise PosesInvalid(
            POSE_FILE,
            "must have one row per photo, in the order of their names",
            f"{len(rows)} rows for {len(paths)} photos in {folder.path.name}",
            REMEDY,
        )
    photos = [_photo(row, path, folder, root) for row, path in zip(rows, paths, strict=True)]
    notes = () if folder.path.name in ("images", root.name) else (f"Photos are taken from {folder.path.name}.",)
    return Listing(*held_out(photos), notes + mask_notes(photos), up_known=False)


def _has_photos(folder: Path) -> bool:
    return bool(photos_in(folder))


def _read_rows(path: Path) -> np.ndarray:
    """[n, 17] float64, n >= 1, finite."""
    if path.stat().st_size > MAX_BYTES:
        raise PosesInvalid(POSE_FILE, f"must be at most {MAX_BYTES >> 20} MB", "more", REMEDY)
    try:
        with path.open("rb") as file:
            rows = np.lib.format.read_array(file, allow_pickle=False)
        rows = np.asarray(rows, np.float64)
    except Exception as error:  # a header is a Python literal: damaged ones raise almost anything
        raise PosesInvalid(POSE_FILE, "must be a NumPy array of numbers", "a file that is not", REMEDY) from error
    if rows.ndim != 2 or rows.shape[1] != COLUMNS or not len(rows):
        raise PosesInvalid(POSE_FILE, "must have 17 numbers for each photo", f"shape {rows.shape}", REMEDY)
    if not np.isfinite(rows).all():
        raise PoseNotFinite(POSE_FILE, "every number must be finite", "NaN or infinity", REMEDY)
    return rows


def _photo(row: np.ndarray, path: Path, folder: PhotoFolder, root: Path) -> Photo:
    name = path.relative_to(root).as_posix()
    matrix, (near, far) = row[:15].reshape(3, 5), row[15:]
    if not 0 < near <= far:
        raise PosesInvalid(
            f"depth bounds of {name}", "must be positive, near before far", f"{near:g} and {far:g}", REMEDY
        )
    size_px, focal = _size(matrix), matrix[2, 4]
    if focal <= 0:
        raise PosesInvalid(f"focal length of {name}", "must be positive", f"{focal:g}", REMEDY)
    full = Lens((focal, focal), (size_px[0] / 2, size_px[1] / 2), size_px)
    lens = of_stored_size(full, read_size(path, name), name)
    down, right, backwards, position = matrix[:, :4].T
    pose = np.stack([right, -down, backwards, position], 1)
    camera = pinhole_camera(path.stem, pose, lens)
    relative = PurePosixPath(path.name)
    mask = find_mask(root / FOLDER, relative)
    return Photo(path, name, relative, camera, lens, mask, (float(near), float(far)), folder.scale)


def _size(matrix: np.ndarray) -> tuple[int, int]:
    """(width, height) of a pose matrix [3, 5]."""
    height, width = matrix[0, 4], matrix[1, 4]
    if not (1 <= width <= 1e6 and 1 <= height <= 1e6):
        raise PosesInvalid(POSE_FILE, "must state the photos' height and width", f"{height:g} x {width:g}", REMEDY)
    return round(width), round(height)
