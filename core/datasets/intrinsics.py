"""Intrinsics as `transforms*.json` files state them: for all frames, or for each one."""

from __future__ import annotations

import math

from core.datasets.distortion import Distortion
from core.datasets.lens import Lens
from core.datasets.posefile import PoseFile
from core.errors import ImageSizeMismatch, PosesInvalid

PINHOLE_LIKE = ("OPENCV", "PINHOLE", "SIMPLE_PINHOLE", "RADIAL", "SIMPLE_RADIAL", "PERSPECTIVE")
FISHEYE_LIKE = ("OPENCV_FISHEYE",)
KEYS = (
    "fl_x", "fl_y", "cx", "cy", "w", "h", "camera_angle_x", "camera_angle_y", "camera_model", "is_fisheye",
    "k1", "k2", "k3", "k4", "p1", "p2",
)  # fmt: skip


def lens_of(shared: PoseFile, frame: PoseFile, size_px: tuple[int, int], photo: str) -> Lens:
    """A photo's intrinsics; what its frame states goes before what the file states for all.

    Focal lengths (`fl_x`, pixels) go before angles (`camera_angle_x`, radians, the whole field of view); without a
    vertical one pixels are square; without a centre it is the middle of the photo.

    Args:
        size_px: (width, height) of the photo as stored.
        photo: its name, for messages.

    Raises:
        PosesInvalid: no focal length, wrong types, or a lens of another kind.
        ImageSizeMismatch: the photo has not the stated w and h.
    """
    merged = PoseFile(frame.name, {key: frame.fields.get(key, shared.fields.get(key)) for key in KEYS})
    fisheye = _is_fisheye(merged)
    _check_size(merged, size_px, photo)
    focal_x = merged.number("fl_x") or _focal_from_angle(merged, "camera_angle_x", size_px[0])
    focal_y = merged.number("fl_y") or _focal_from_angle(merged, "camera_angle_y", size_px[1])
    focal_x, focal_y = focal_x or focal_y, focal_y or focal_x
    if focal_x is None or focal_y is None or min(focal_x, focal_y) <= 0:
        raise merged.invalid('needs "fl_x" or "camera_angle_x", positive', focal_x)
    centre_x, centre_y = merged.number("cx"), merged.number("cy")
    centre = (size_px[0] / 2 if centre_x is None else centre_x, size_px[1] / 2 if centre_y is None else centre_y)
    # OpenCV's fisheye module has no tangential terms; files that state some mean another model's.
    keys = ("k1", "k2", "k3", "k4") if fisheye else ("k1", "k2", "k3", "k4", "p1", "p2")
    coefficients = {key: merged.number(key) or 0.0 for key in keys}
    return Lens((focal_x, focal_y), centre, size_px, Distortion(**coefficients, fisheye=fisheye))


def _focal_from_angle(fields: PoseFile, key: str, size_px: int) -> float | None:
    angle = fields.number(key)
    if angle is None:
        return None
    if not 0.001 < angle < math.pi - 0.001:
        raise fields.invalid(f'"{key}" must be an angle between 0 and pi (radians)', angle)
    return 0.5 * size_px / math.tan(0.5 * angle)


def _is_fisheye(fields: PoseFile) -> bool:
    model = (fields.text("camera_model") or "PINHOLE").upper()
    if model not in (*PINHOLE_LIKE, *FISHEYE_LIKE):
        raise PosesInvalid(
            fields.name,
            f"the camera model must be one of {', '.join((*PINHOLE_LIKE, *FISHEYE_LIKE))}",
            f"{model[:40]}; panoramas are not supported",
            "Undistort the photos to a pinhole camera first (COLMAP's image_undistorter does), and pose those.",
        )
    return model in FISHEYE_LIKE or bool(fields.fields.get("is_fisheye"))


def _check_size(fields: PoseFile, size_px: tuple[int, int], photo: str) -> None:
    stated = (fields.size("w") or size_px[0], fields.size("h") or size_px[1])
    if stated != size_px:
        turned = stated == size_px[::-1]
        raise ImageSizeMismatch(
            f"photo {photo}",
            f"must have the {stated[0]} x {stated[1]} px that the pose file states",
            f"{size_px[0]} x {size_px[1]} px",
            "Store the photos upright; their EXIF orientation is not applied."
            if turned
            else 'Use the photos that were posed, or correct "w", "h" and the intrinsics in the pose file.',
        )
