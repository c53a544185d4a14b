"""COLMAP's text files (colmap.github.io/format.html): fields between blanks, comments behind #."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from core.datasets.colmap_model import REMEDY, ModelImage, ModelPoints, lens_of_model
from core.datasets.lens import Lens
from core.errors import PosesInvalid


def read_cameras(path: Path) -> dict[int, Lens]:
    """Lenses by camera id, from lines of: id, model, width, height, parameters.

    Raises:
        PosesInvalid
    """
    lenses = {}
    for number, line in _lines(path):
        fields = line.split()
        try:
            camera_id, model, size = int(fields[0]), fields[1], (int(fields[2]), int(fields[3]))
            parameters = [float(field) for field in fields[4:]]
        except (ValueError, IndexError, OverflowError) as error:
            raise _invalid(path, number, "must be a camera", line) from error
        lenses[camera_id] = lens_of_model(model, size, parameters)
    return lenses


def read_images(path: Path) -> tuple[ModelImage, ...]:
    """Posed images in the file's order; of each pair of lines the second, its observations, is not needed.

    Raises:
        PosesInvalid
    """
    images = []
    for number, line in _first_of_pairs(path):
        fields = line.split(maxsplit=9)  # names may have blanks
        try:
            pose = np.array([float(field) for field in fields[1:8]])
            images.append(ModelImage(int(fields[0]), int(fields[8]), fields[9].strip(), pose[:4], pose[4:]))
        except (ValueError, IndexError, OverflowError) as error:
            raise _invalid(path, number, "must be an image: id, pose (7 numbers), camera, name", line) from error
    return tuple(images)


def count_images(path: Path) -> int:
    """How many images the file has."""
    return sum(1 for _ in _first_of_pairs(path))


def read_points(path: Path) -> ModelPoints:
    """Points and their observations, from lines of: id, x, y, z, r, g, b, error, pairs of image id and index.

    Raises:
        PosesInvalid
    """
    positions, tracks = [], []
    for number, line in _lines(path):
        fields = line.split()
        try:
            positions.append((float(fields[1]), float(fields[2]), float(fields[3])))
            tracks.append(np.array([int(field) for field in fields[8::2]], np.int64))
        except (ValueError, IndexError, OverflowError) as error:
            raise _invalid(path, number, "must be a point", line) from error
    return ModelPoints.of(positions, tracks)


def _lines(path: Path) -> Iterator[tuple[int, str]]:
    """Lines with content, numbered from 1."""
    for number, line in _raw_lines(path):
        if line.strip() and not line.startswith("#"):
            yield number, line


def _first_of_pairs(path: Path) -> Iterator[tuple[int, str]]:
    """Every first line of a pair. The second may be empty, so blank lines count except before a first one."""
    lines = _raw_lines(path)
    for number, line in lines:
        if line.strip() and not line.startswith("#"):
            yield number, line
            next(lines, None)


def _raw_lines(path: Path) -> Iterator[tuple[int, str]]:
    with path.open(encoding="utf-8", errors="replace") as file:
        yield from enumerate(file, start=1)


def _invalid(path: Path, number: int, rule: str, line: str) -> PosesInvalid:
    return PosesInvalid(f"{path.name}, line {number}", rule, line.strip()[:60], REMEDY)
