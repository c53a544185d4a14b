"""COLMAP captures: a sparse model, binary or text, and its photos in `images` or a smaller copy of it.

The frame of a model is arbitrary. Photos are taken as they are stored: COLMAP, too, ignores their EXIF orientation.
"""

from __future__ import annotations

from collections import Counter
from pathlib import Path, PurePosixPath

import numpy as np

from core.camera import Camera
from core.datasets import colmap_binary, colmap_text
from core.datasets.colmap_model import REMEDY, ColmapModel, ModelImage, ModelPoints
from core.datasets.listing import Listing, Photo, held_out, mask_notes
from core.datasets.masks import FOLDER, find_mask
from core.datasets.photo_folders import PhotoFolder, Reduction, chosen_folder
from core.datasets.photo_paths import PhotoFinder, relative_photo_path
from core.datasets.posed_photos import pinhole_camera
from core.datasets.scaled_lens import of_stored_size
from core.errors import PosesInvalid
from core.images import read_size

FORMATS = {".bin": colmap_binary, ".txt": colmap_text}
SPARSE, WORKSPACE = "sparse", "colmap"
PLACES = (SPARSE, f"{WORKSPACE}/{SPARSE}", ".")  # of models, below a capture's folder
LEAST_OBSERVATIONS = 10  # in a photo, for bounds of its depth
OUTLIER_SHARE = 0.005
LEAST_TRACK = 3  # photos that observe a point, for it to be trusted
LEAST_TRUSTED = 100


def find_models(folder: Path) -> list[Path]:
    """The cameras files of the models of a capture's folder, all from one place; COLMAP numbers its models."""
    for base in (folder / place for place in PLACES):
        if base.is_dir():
            numbered = sorted((child for child in base.iterdir() if child.name.isdecimal()), key=lambda c: int(c.name))
            found = [path for candidate in (*numbered, base) if (path := cameras_file(candidate))]
            if found:
                return found
    return []


def cameras_file(folder: Path) -> Path | None:
    """The cameras file of a model's folder, if its images file is there, too; binary before text."""
    for suffix in FORMATS:
        if (folder / f"cameras{suffix}").is_file() and (folder / f"images{suffix}").is_file():
            return folder / f"cameras{suffix}"
    return None


def capture_root(folder: Path) -> Path:
    """The capture's folder, of a model's folder: above sparse/0, sparse, or colmap/sparse/0; else the folder itself."""
    root = folder.absolute()
    if root.name.isdecimal() and root.parent.name == SPARSE:
        root = root.parent
    if root.name == SPARSE:
        root = root.parent
        if root.name == WORKSPACE and not (root / "images").is_dir():
            root = root.parent
    return root


def list_colmap(
    cameras_paths: list[Path],
    root: Path,
    reduction: Reduction,
    photo_folder: Path | None = None,
    *,
    skip_missing: bool = False,
) -> Listing:
    """The capture's photos, posed and with their headers checked; every 8th is held out.

    Args:
        cameras_paths: the cameras files of one or more models; that with the most images is taken.
        root: the capture's folder, with the photos.
        reduction: decides which of several folders of photos is taken.
        photo_folder: the folder to take, if the user named one.

    Raises:
        InputError: see `core.datasets.check_capture`.
    """
    cameras_path, notes = _largest(cameras_paths)
    model = read_model(cameras_path)
    for image in model.images:
        _check(image, model)
    folder = PhotoFolder(photo_folder) if photo_folder else _folder(root, model, reduction)
    finder = PhotoFinder(folder.path)
    paths = [finder.find(image.name) for image in model.images]
    notes += finder.left_out() if skip_missing else finder.check_none_missing()
    names, ranges = _camera_names(model.images), _depth_ranges(model)
    photos = [
        _photo(image, model, path, root, folder.scale, names[image.name], ranges.get(image.image_id))
        for image, path in zip(model.images, paths, strict=True)
        if path is not None
    ]
    if folder.path.name not in ("images", root.name):
        notes += (f"Photos are taken from {folder.path.name}.",)
    points = model.points.positions if len(model.points.positions) else None
    return Listing(*held_out(photos), notes + mask_notes(photos), points, up_known=False)


def read_model(cameras_path: Path) -> ColmapModel:
    """A model by its cameras file; without a points file it has no points.

    Raises:
        PosesInvalid: damaged, or without a posed image.
    """
    suffix, folder = cameras_path.suffix, cameras_path.parent
    files = FORMATS[suffix]
    images = files.read_images(folder / f"images{suffix}")
    if not images:
        raise PosesInvalid(f"images{suffix}", "must have posed images", "none", "Take another model, or pose again.")
    points_path = folder / f"points3D{suffix}"
    points = files.read_points(points_path) if points_path.is_file() else ModelPoints.of([], [])
    return ColmapModel(files.read_cameras(cameras_path), images, _trusted(points))


def _largest(cameras_paths: list[Path]) -> tuple[Path, tuple[str, ...]]:
    """The model with the most images, and a remark where there were others."""
    if len(cameras_paths) == 1:
        return cameras_paths[0], ()
    counts = [FORMATS[path.suffix].count_images(path.with_name(f"images{path.suffix}")) for path in cameras_paths]
    best = int(np.argmax(counts))
    name = cameras_paths[best].parent.name
    return cameras_paths[best], (
        f"Of {len(counts)} COLMAP models, {name} is used: it has the most photos ({counts[best]} of {sum(counts)}).",
    )


def _trusted(points: ModelPoints) -> ModelPoints:
    """Points that at least three images observe, where there are enough of them."""
    keep = points.track_lengths >= LEAST_TRACK
    if keep.sum() < LEAST_TRUSTED:
        return points
    observations = points.track_images[np.repeat(keep, points.track_lengths)]
    return ModelPoints(points.positions[keep], observations, points.track_lengths[keep])


def _check(image: ModelImage, model: ColmapModel) -> None:
    """The name, the pose and the camera's existence: they may be wrong before any photo is opened."""
    relative_photo_path(image.name)
    Camera(image.name, image.world_from_camera, (1.0, 1.0), (0.5, 0.5), (1, 1))
    if image.camera_id not in model.lenses:
        raise PosesInvalid(f"image {image.name}", "must have a camera of the model", str(image.camera_id), REMEDY)


def _folder(root: Path, model: ColmapModel, reduction: Reduction) -> PhotoFolder:
    some = [image.name for image in model.images[:10]]
    full_size_px = model.lenses[model.images[0].camera_id].size_px
    return chosen_folder(root, full_size_px, reduction, lambda path: any(map(PhotoFinder(path).find, some)))


def _camera_names(images: tuple[ModelImage, ...]) -> dict[str, str]:
    """Names without folder and suffix; with the folder where they would not be unique."""
    stems = Counter(PurePosixPath(image.name).stem for image in images)
    paths = {image.name: PurePosixPath(image.name) for image in images}
    return {
        name: path.stem if stems[path.stem] == 1 else "_".join(path.with_suffix("").parts)
        for name, path in paths.items()
    }


def _depth_ranges(model: ColmapModel) -> dict[int, tuple[float, float]]:
    """(near, far) by image id, of the points that the image observes, without outliers (as LLFF does)."""
    observed, ranges = model.points.observed_by(), {}
    for image in model.images:
        pose = image.world_from_camera
        depths = (observed.get(image.image_id, np.zeros((0, 3))) - pose[:3, 3]) @ -pose[:3, 2]
        depths = depths[depths > 0]
        if len(depths) >= LEAST_OBSERVATIONS:
            near, far = np.quantile(depths, [OUTLIER_SHARE, 1 - OUTLIER_SHARE])
            ranges[image.image_id] = (float(near), float(far))
    return ranges


def _photo(
    image: ModelImage,
    model: ColmapModel,
    path: Path,
    root: Path,
    scale: float,
    camera_name: str,
    depth_range: tuple[float, float] | None,
) -> Photo:
    absolute = path.absolute()
    name = absolute.relative_to(root).as_posix() if absolute.is_relative_to(root) else path.name
    lens = of_stored_size(model.lenses[image.camera_id], read_size(path, name), name)
    camera = pinhole_camera(camera_name, image.world_from_camera, lens)
    relative = relative_photo_path(image.name)
    return Photo(path, name, relative, camera, lens, find_mask(root / FOLDER, relative), depth_range, scale)
