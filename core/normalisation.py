"""Captures moved from the user's frame into the object frame, where everything downstream works.

    x_user = scale * rotation @ x_object + centre

The object frame has +z up, its origin at what the cameras look at, and a median camera distance of 1 from it. So a
scene in micrometres, or one that lies a million times its size away from its origin, is trained like any other. All of
it is float64, and differences are taken before anything is scaled.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from core.camera import Camera
from core.capture import Capture, View
from core.conventions import ASSET_FROM_Z_UP
from core.rig import Rig
from core.scene_kind import FORWARD

# Of the cameras' horizontal axes: how much they must spread for the up axis to follow from them alone. (The second
# singular value of n unit vectors is at most sqrt(n / 2); as nerfstudio's "vertical" orientation.)
LEAST_TURN = 0.17


@dataclass(frozen=True)
class Similarity:
    """x_user = scale * rotation @ x_object + centre: rotation [3, 3], centre [3], float64; scale > 0."""

    rotation: np.ndarray
    centre: np.ndarray
    scale: float

    @property
    def matrix(self) -> np.ndarray:
        """[4, 4] float64, user from object."""
        matrix = np.eye(4)
        matrix[:3, :3] = self.scale * self.rotation
        matrix[:3, 3] = self.centre
        return matrix

    def to_object(self, points: np.ndarray) -> np.ndarray:
        """Points [..., 3] of the user's frame in the object frame."""
        return (np.asarray(points, np.float64) - self.centre) @ self.rotation / self.scale

    def camera_to_object(self, camera: Camera) -> Camera:
        pose = np.eye(4)
        pose[:3, :3] = self.rotation.T @ camera.world_from_camera[:3, :3]
        pose[:3, 3] = self.to_object(camera.position)
        return replace(camera, world_from_camera=pose)

    def view_to_object(self, view: View) -> View:
        bounds = view.depth_range
        if bounds is not None:
            bounds = (bounds[0] / self.scale, bounds[1] / self.scale)
        return replace(view, camera=self.camera_to_object(view.camera), depth_range=bounds)


def pose_in_user_frame(user_from_object: np.ndarray, camera: Camera) -> np.ndarray:
    """[4, 4] float64, rigid: the camera's pose in the frame of the user's files.

    Args:
        user_from_object: [4, 4], a similarity, as `Capture.user_from_object`.
    """
    scale = float(np.cbrt(np.linalg.det(user_from_object[:3, :3])))
    pose = user_from_object @ camera.world_from_camera
    pose[:3, :3] /= scale
    return pose


def normalised(capture: Capture, *, up_known: bool = True) -> Capture:
    """The capture in the object frame; `user_from_object` leads back.

    Args:
        up_known: the capture's own frame has +z up by convention (NeRF-synthetic, nerfstudio): its axes, and in the
            asset its scale and place, are kept. Otherwise (LLFF, COLMAP) the frame is arbitrary: up is estimated from
            the cameras, +y is where they look, and the asset is upright and centred.
    """
    rig = Rig.of(capture.train, capture.points)
    rotation = np.eye(3) if up_known else _upright(rig)
    centre = _centre(capture, rig)
    transform = Similarity(rotation, rig.origin + centre, _unit(rig, centre))
    user_from_object = capture.user_from_object @ transform.matrix
    return replace(
        capture,
        train=tuple(map(transform.view_to_object, capture.train)),
        test=tuple(map(transform.view_to_object, capture.test)),
        points=None if capture.points is None else transform.to_object(capture.points),
        user_from_object=user_from_object,
        asset_from_object=ASSET_FROM_Z_UP @ user_from_object if up_known else ASSET_FROM_Z_UP.copy(),
    )


def _centre(capture: Capture, rig: Rig) -> np.ndarray:
    """[3], relative to the rig's origin: what the cameras look at."""
    if capture.kind.name == FORWARD and rig.mean_axis is not None:
        return rig.middle + rig.focus_depth * rig.mean_axis
    return rig.looked_at


def _unit(rig: Rig, centre: np.ndarray) -> float:
    """The user's length that becomes 1; never 0."""
    rounding = 1e-9 * max(rig.spread, rig.focus_depth)
    distance = float(np.median(np.linalg.norm(rig.positions - centre, axis=1)))
    if distance > rounding and (rig.spread > 0 or rig.focus_depth > 0):
        return distance
    return rig.spread or rig.focus_depth or 1.0


def _upright(rig: Rig) -> np.ndarray:
    """[3, 3], columns are the object's axes in the user's frame: z up, y where the cameras look, as far as it is level.

    Up is across all cameras' horizontal axes where these turn enough to tell, else the mean of the cameras' up axes.
    """
    up = _unit_or(rig.ups.mean(0), rig.ups[0])
    _, strength, directions = np.linalg.svd(rig.rights, full_matrices=True)
    turns = len(strength) > 2 and strength[1] > LEAST_TURN * np.sqrt(len(rig.rights))
    # A person keeps the camera level more carefully than horizontal: tilt up or down does not turn the rights.
    across = directions[2] * np.sign(directions[2] @ up) if turns else up - (up @ directions[0]) * directions[0]
    z = _unit_or(across, up)
    forwards = [axis for axis in (rig.mean_axis, *rig.axes, *rig.ups) if axis is not None]
    level = next(f - (f @ z) * z for f in forwards if np.linalg.norm(f - (f @ z) * z) > 0.1)
    y = level / np.linalg.norm(level)
    return np.stack([np.cross(y, z), y, z], 1)


def _unit_or(vector: np.ndarray, otherwise: np.ndarray) -> np.ndarray:
    length = float(np.linalg.norm(vector))
    return vector / length if length > 1e-6 else otherwise
