"""Cameras and points from matches: COLMAP's incremental mapper."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path

import pycolmap

from core.posing.photo_set import MIN_PHOTOS

# The mapper's default of 10 would throw small captures away.
MIN_MODEL_PHOTOS = MIN_PHOTOS


def mapped(database_path: Path, count: int, seed: int, done: Callable[[float], None]) -> list[pycolmap.Reconstruction]:
    """Models of photos that could be posed together, the one with most photos first; none where there is none.

    Args:
        count: of photos.
        done: is told the share of photos that have been posed; it stands still while all cameras are refined together.
    """
    placed = 0

    def on_photo() -> None:
        nonlocal placed
        placed += 1
        done(min(1.0, (placed + 1) / count))

    scratch = database_path.with_name("mapping")
    shutil.rmtree(scratch, ignore_errors=True)
    scratch.mkdir()
    pycolmap.set_random_seed(seed)
    models = pycolmap.incremental_mapping(
        database_path,
        database_path.parent / "images",
        scratch,
        _options(seed),
        initial_image_pair_callback=on_photo,
        next_image_callback=on_photo,
    )
    shutil.rmtree(scratch, ignore_errors=True)
    return sorted(models.values(), key=lambda model: (-model.num_reg_images(), -model.num_points3D()))


def write_model(model: pycolmap.Reconstruction, photos: dict[int, str], folder: Path) -> None:
    """Writes a model as `cameras.bin`, `images.bin` and `points3D.bin`, with the photos' own names."""
    for number in model.images:
        model.image(number).name = photos[number]
    part = folder.with_name(f".{folder.name}.part")
    for old in (part, folder):
        shutil.rmtree(old, ignore_errors=True)
    part.mkdir(parents=True)
    model.write_binary(part)
    part.rename(folder)


def _options(seed: int) -> pycolmap.IncrementalPipelineOptions:
    options = pycolmap.IncrementalPipelineOptions()
    options.min_model_size = MIN_MODEL_PHOTOS
    options.extract_colors = False
    options.num_threads = options.mapper.num_threads = 1
    for part in (options, options.mapper, options.triangulation):
        part.random_seed = seed
    return options
