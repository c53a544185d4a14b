"""COLMAP's binary files (src/colmap/scene/reconstruction_io_binary.cc): little-endian, unpadded, a count first.

Counts are never believed: every record is read within the file, so a damaged count ends in an error, not in a long
loop or an allocation.
"""

from __future__ import annotations

import mmap
import struct
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from core.datasets.colmap_model import NAME_OF_NUMBER, PARAMETERS, REMEDY, ModelImage, ModelPoints, lens_of_model
from core.datasets.lens import Lens
from core.errors import PosesInvalid

OBSERVATION_BYTES = 24  # x, y float64; point id int64
TRACK_ELEMENT = np.dtype([("image", "<u4"), ("observation", "<u4")])
MAX_NAME_BYTES = 4096


class Bytes:
    """A file as bytes, read from front to back."""

    def __init__(self, name: str, data: mmap.mmap | bytes) -> None:
        self.name, self._data, self._at = name, data, 0

    def take(self, layout: str) -> tuple:
        """The next numbers, by a `struct` layout without byte order."""
        layout = "<" + layout
        at = self._advance(struct.calcsize(layout))
        return struct.unpack_from(layout, self._data, at)

    def array(self, dtype: np.dtype, count: int) -> np.ndarray:
        at = self._advance(count * dtype.itemsize)
        return np.frombuffer(self._data, dtype, count, at).copy()

    def skip(self, count: int) -> None:
        self._advance(count)

    def text(self) -> str:
        """A string that ends with a zero byte."""
        end = self._data.find(b"\0", self._at, self._at + MAX_NAME_BYTES)
        if end < 0:
            raise self.damaged()
        raw = bytes(self._data[self._at : end])
        self._at = end + 1
        return raw.decode("utf-8", "replace")

    def damaged(self) -> PosesInvalid:
        return PosesInvalid(self.name, "must be a whole COLMAP model file", f"damage at byte {self._at}", REMEDY)

    def _advance(self, count: int) -> int:
        at = self._at
        if count > len(self._data) - at:
            raise self.damaged()
        self._at = at + count
        return at


@contextmanager
def opened(path: Path) -> Iterator[Bytes]:
    """The file's bytes, mapped: images.bin of a large model has gigabytes, of which little is read."""
    with path.open("rb") as file:
        if path.stat().st_size == 0:
            yield Bytes(path.name, b"")
            return
        with mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as data:
            yield Bytes(path.name, data)


def read_cameras(path: Path) -> dict[int, Lens]:
    """Lenses by camera id.

    Raises:
        PosesInvalid
    """
    lenses = {}
    with opened(path) as data:
        for _ in range(*data.take("Q")):
            camera_id, number, width, height = data.take("IiQQ")
            if number not in NAME_OF_NUMBER:
                lens_of_model(f"number {number}", (1, 1), ())
            model = NAME_OF_NUMBER[number]
            parameters = data.take(f"{len(PARAMETERS[model][1].split())}d")
            lenses[camera_id] = lens_of_model(model, (width, height), parameters)
    return lenses


def read_images(path: Path) -> tuple[ModelImage, ...]:
    """Posed images in the file's order.

    Raises:
        PosesInvalid
    """
    images = []
    with opened(path) as data:
        for _ in range(*data.take("Q")):
            image_id, *pose, camera_id = data.take("I7dI")
            name = data.text()
            data.skip(data.take("Q")[0] * OBSERVATION_BYTES)
            images.append(ModelImage(image_id, camera_id, name, np.array(pose[:4]), np.array(pose[4:])))
    return tuple(images)


def count_images(path: Path) -> int:
    """How many images the file says it has."""
    with opened(path) as data:
        return data.take("Q")[0]


def read_points(path: Path) -> ModelPoints:
    """Points and their observations.

    Raises:
        PosesInvalid
    """
    positions, tracks = [], []
    with opened(path) as data:
        for _ in range(*data.take("Q")):
            _, x, y, z, _, _, length = data.take("Q3d3sdQ")  # id, position, colour, error, track
            positions.append((x, y, z))
            tracks.append(data.array(TRACK_ELEMENT, length)["image"])
    return ModelPoints.of(positions, tracks)
