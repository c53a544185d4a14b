"""SIFT features of the photos, kept in COLMAP's database as they are found."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pycolmap

from core.errors import InputError
from core.images import read_reduced, read_size
from core.posing.lenses import SharedLens
from core.posing.posing import NO_DETAIL

# Photos are reduced to this longest side. Poses get no better from more (their error is about half a pixel of these),
# and a photo takes 1.2 s and 150 MB a thread, whatever it had.
MAX_SIDE_PX = 2000
# Smaller photos are doubled first: 200 px would otherwise give a few dozen features.
DOUBLED_UP_TO_PX = 1200
MAX_FEATURES = 6000
MIN_FEATURES = 50  # fewer match by chance only
UNDECODABLE = "cannot be decoded"
LUMA = (0.299, 0.587, 0.114)
THREADS = 2  # each holds a photo


def write_cameras(database_path: Path, lenses: list[SharedLens], photos: dict[int, str]) -> None:
    """Enters all photos and their lenses in the database, if that is not done yet.

    Args:
        photos: number to name. The database knows photos by their numbers: COLMAP's lists of pairs have no way to write
            a name with a blank.
    """
    numbers = {name: number for number, name in photos.items()}
    with pycolmap.Database.open(database_path) as database:
        if database.num_images() > 0:
            return
        with pycolmap.DatabaseTransaction(database):
            for lens_number, lens in enumerate(lenses, start=1):
                _write_lens(database, lens_number, lens, [numbers[name] for name in lens.names])


def _write_lens(database: pycolmap.Database, number: int, lens: SharedLens, photos: list[int]) -> None:
    camera = pycolmap.Camera.create_from_model_name(number, lens.model, lens.focal_px, *lens.size_px)
    camera.has_prior_focal_length = lens.focal_known
    database.write_camera(camera, use_camera_id=True)
    rig = pycolmap.Rig()
    rig.rig_id = number
    rig.add_ref_sensor(camera.sensor_id)
    database.write_rig(rig, use_rig_id=True)
    for photo in photos:
        image = pycolmap.Image(name=str(photo), camera_id=number, image_id=photo)
        database.write_image(image, use_image_id=True)
        frame = pycolmap.Frame()
        frame.frame_id, frame.rig_id = photo, number
        frame.add_data_id(image.data_id)
        database.write_frame(frame, use_frame_id=True)


def write_features(
    database_path: Path, images: Path, photos: dict[int, str], done: Callable[[float], None]
) -> dict[int, str]:
    """Finds the features of all photos that have none yet.

    Args:
        images: the photos' folder.
        photos: number to name.
        done: is told the share of photos that have theirs.

    Returns:
        Why photos have none or hardly any, by number.
    """
    faults: dict[int, str] = {}
    with pycolmap.Database.open(database_path) as database:
        waiting = [number for number in photos if not database.exists_descriptors(number)]
        ready = len(photos) - len(waiting)
        for count, (number, found) in enumerate(_found(images, photos, waiting), start=1):
            if isinstance(found, InputError):
                faults[number] = UNDECODABLE
            else:
                keypoints, descriptors = found
                database.write_keypoints(number, keypoints)
                database.write_descriptors(number, descriptors)  # last: they mark the photo as done
            done((ready + count) / len(photos))
        for number in photos:
            if number not in faults and database.num_keypoints_for_image(number) < MIN_FEATURES:
                faults[number] = NO_DETAIL
    return faults


Features = tuple[np.ndarray, pycolmap.FeatureDescriptors]


def _found(images: Path, names: dict[int, str], waiting: list[int]) -> Iterator[tuple[int, Features | InputError]]:
    """Features, photo by photo in the order of `waiting`, two photos at a time."""
    local = threading.local()

    def work(number: int) -> Features | InputError:
        try:
            return _features(local, images / names[number], names[number])
        except InputError as error:
            return error

    with ThreadPoolExecutor(THREADS) as threads:
        running: list[tuple[int, Future[Features | InputError]]] = []
        queue = iter(waiting)
        try:
            for number in queue:
                running.append((number, threads.submit(work, number)))
                if len(running) > THREADS:
                    first, future = running.pop(0)
                    yield first, future.result()
            for first, future in running:
                yield first, future.result()
        finally:
            threads.shutdown(cancel_futures=True)


def _features(local: threading.local, path: Path, name: str) -> Features:
    """Keypoints [n, 4] float32 (x, y in pixels of the whole photo, scale, orientation) and their descriptors."""
    photo = read_reduced(path, MAX_SIDE_PX, name)
    height, width = photo.shape[:2]
    grey, opaque = _grey_over_white(photo)
    doubled = max(width, height) <= DOUBLED_UP_TO_PX
    keypoints, descriptors = _extractor(local, doubled).extract_from_uint8_array(grey)
    if len(keypoints) == 0:
        return np.zeros((0, 4), np.float32), descriptors
    matrix = np.array(pycolmap.keypoints_to_matrix(keypoints), np.float32)
    # A silhouette's features belong to no point of the surface.
    at = np.clip(matrix[:, :2].astype(int), 0, [width - 1, height - 1])
    kept = np.flatnonzero(opaque[at[:, 1], at[:, 0]])
    return _at_full_size(matrix[kept], (width, height), read_size(path, name)), _chosen(descriptors, kept)


def _extractor(local: threading.local, doubled: bool) -> pycolmap.FeatureExtractor:
    """One a thread: it keeps buffers."""
    if not hasattr(local, "extractors"):
        local.extractors = {}
    if doubled not in local.extractors:
        options = pycolmap.FeatureExtractionOptions()
        options.use_gpu, options.num_threads, options.max_image_size = False, 1, MAX_SIDE_PX
        options.sift.max_num_features = MAX_FEATURES
        options.sift.first_octave = -1 if doubled else 0
        local.extractors[doubled] = pycolmap.FeatureExtractor.create(options, pycolmap.Device.cpu)
    return local.extractors[doubled]


def _grey_over_white(photo_u8: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(grey [h, w] uint8, opaque [h, w] bool)."""
    colour = photo_u8[..., :3].astype(np.float32)
    opaque = np.ones(photo_u8.shape[:2], bool)
    if photo_u8.shape[2] == 4:
        alpha = photo_u8[..., 3:].astype(np.float32) / 255.0
        colour = colour * alpha + 255.0 * (1.0 - alpha)
        opaque = photo_u8[..., 3] >= 128
    return np.rint(colour @ np.array(LUMA, np.float32)).astype(np.uint8), opaque


def _at_full_size(keypoints: np.ndarray, size_px: tuple[int, int], full_px: tuple[int, int]) -> np.ndarray:
    scale = np.array(full_px) / size_px
    return (keypoints * [*scale, scale.mean(), 1.0]).astype(np.float32)


def _chosen(descriptors: pycolmap.FeatureDescriptors, kept: np.ndarray) -> pycolmap.FeatureDescriptors:
    return pycolmap.FeatureDescriptors(descriptors.type, np.ascontiguousarray(descriptors.data[kept]))
