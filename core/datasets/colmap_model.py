"""A COLMAP sparse model: cameras, posed images and points, as its files state them.

Read by our own code, because models come from strangers: pycolmap (4.2) never returns from some damaged files, and
takes over the process's signals. The tests compare both on sound models.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from core.datasets.distortion import Distortion
from core.datasets.lens import Lens
from core.errors import PosesInvalid

REMEDY = "Export the model again (colmap model_converter), or undistort it (colmap image_undistorter)."

# Names and numbers of COLMAP's camera models, and their parameters (src/colmap/sensor/models.h). "f" is fx = fy.
PARAMETERS: dict[str, tuple[int, str]] = {
    "SIMPLE_PINHOLE": (0, "f cx cy"),
    "PINHOLE": (1, "fx fy cx cy"),
    "SIMPLE_RADIAL": (2, "f cx cy k1"),
    "RADIAL": (3, "f cx cy k1 k2"),
    "OPENCV": (4, "fx fy cx cy k1 k2 p1 p2"),
    "OPENCV_FISHEYE": (5, "fx fy cx cy k1 k2 k3 k4"),
    "FULL_OPENCV": (6, "fx fy cx cy k1 k2 p1 p2 k3 d1 d2 d3"),
    "SIMPLE_RADIAL_FISHEYE": (8, "f cx cy k1"),
    "RADIAL_FISHEYE": (9, "f cx cy k1 k2"),
    "THIN_PRISM_FISHEYE": (10, "fx fy cx cy k1 k2 p1 p2 k3 k4 s1 s2"),
    "SIMPLE_FISHEYE": (14, "f cx cy"),
    "FISHEYE": (15, "fx fy cx cy"),
}
NAME_OF_NUMBER = {number: name for name, (number, _) in PARAMETERS.items()}


@dataclass(frozen=True)
class ModelImage:
    """Attributes:
    name: path below the folder of images.
    quaternion: (w, x, y, z), camera from world; OpenCV axes (x right, y down, z forwards).
    translation: [3] float64, camera from world.
    """

    image_id: int
    camera_id: int
    name: str
    quaternion: np.ndarray
    translation: np.ndarray

    @property
    def world_from_camera(self) -> np.ndarray:
        """[4, 4] float64, OpenGL axes."""
        rotation = rotation_matrix(self.quaternion)
        pose = np.eye(4)
        pose[:3, :3] = rotation.T * [1.0, -1.0, -1.0]
        pose[:3, 3] = -rotation.T @ self.translation
        return pose


@dataclass(frozen=True)
class ModelPoints:
    """Attributes:
    positions: [n, 3] float64.
    track_images: [m] int64, the image ids of all observations, point after point.
    track_lengths: [n] int64, observations of each point.
    """

    positions: np.ndarray
    track_images: np.ndarray
    track_lengths: np.ndarray

    @classmethod
    def of(cls, positions: Sequence[tuple[float, float, float]], tracks: Sequence[np.ndarray]) -> ModelPoints:
        """Points and, for each, the ids of the images that observe it; points that are not finite are left out."""
        points = np.array(positions, np.float64).reshape(-1, 3)
        lengths = np.array([len(track) for track in tracks], np.int64)
        images = np.concatenate([*tracks, np.zeros(0, np.int64)]).astype(np.int64)
        finite = np.isfinite(points).all(1)
        return cls(points[finite], images[np.repeat(finite, lengths)], lengths[finite])

    def observed_by(self) -> dict[int, np.ndarray]:
        """Positions [k, 3] of the points that each image (by its id) observes."""
        point = np.repeat(np.arange(len(self.positions)), self.track_lengths)
        order = np.argsort(self.track_images, kind="stable")
        ids, starts = np.unique(self.track_images[order], return_index=True)
        parts = np.split(self.positions[point[order]], starts[1:])
        return dict(zip(ids.tolist(), parts, strict=True)) if len(ids) else {}


@dataclass(frozen=True)
class ColmapModel:
    """lenses by camera id, images in the file's order, and points."""

    lenses: dict[int, Lens]
    images: tuple[ModelImage, ...]
    points: ModelPoints


def lens_of_model(model: str, size_px: tuple[int, int], parameters: Sequence[float]) -> Lens:
    """The lens of a COLMAP camera.

    Raises:
        PosesInvalid: a model that is not supported, a wrong number of parameters, or one that is not finite.
    """
    if model not in PARAMETERS:
        raise PosesInvalid("COLMAP camera", f"must be one of {', '.join(PARAMETERS)}", model[:40], REMEDY)
    names = PARAMETERS[model][1].split()
    if len(parameters) != len(names):
        raise PosesInvalid(f"COLMAP camera {model}", f"must have {len(names)} parameters", str(len(parameters)), REMEDY)
    values = dict(zip(names, map(float, parameters), strict=True))
    focal = (values.pop("fx", 0.0), values.pop("fy", 0.0)) if "fx" in values else (values.pop("f"),) * 2
    centre = (values.pop("cx"), values.pop("cy"))
    numbers = [*focal, *centre, *values.values()]
    if not np.isfinite(numbers).all() or min(focal) <= 0 or not all(1 <= side <= 1e6 for side in size_px):
        raise PosesInvalid(
            f"COLMAP camera {model}",
            "must have a size, positive focal lengths, and finite parameters",
            f"{size_px[0]} x {size_px[1]} px, {numbers}"[:120],
            REMEDY,
        )
    return Lens(focal, centre, size_px, Distortion(**values, fisheye=model.endswith("FISHEYE")))


def rotation_matrix(quaternion: np.ndarray) -> np.ndarray:
    """[3, 3] float64 of a quaternion (w, x, y, z) of any length but 0; NaN for that one."""
    with np.errstate(all="ignore"):
        w, x, y, z = np.asarray(quaternion, np.float64) / np.linalg.norm(quaternion)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )
