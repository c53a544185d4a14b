"""OpenGL's matrices of a camera, as the extension's README defines them. Rows first, float64."""

from dataclasses import replace

import numpy as np

from core.baked import BakedScene, similarity_scale
from core.camera import Camera

NEAREST_SHARE = 1e-4  # near plane, of the scene's diagonal, if something reaches behind the camera


def view_from_object(camera: Camera, world_from_object: np.ndarray | None) -> np.ndarray:
    """[4, 4] modelViewMatrix; `world_from_object` is the identity if None."""
    view = np.linalg.inv(camera.world_from_camera)
    return view if world_from_object is None else view @ world_from_object


def in_asset(camera: Camera, asset_from_object: np.ndarray) -> Camera:
    """The camera that sees the asset as `camera` sees the object."""
    pose = asset_from_object @ camera.world_from_camera
    pose[:3, :3] /= similarity_scale(asset_from_object)
    return replace(camera, world_from_camera=pose)


def projection(camera: Camera, model_view: np.ndarray, scene: BakedScene) -> np.ndarray:
    """[4, 4] projectionMatrix of a pinhole whose principal point may be off centre, with tight depth planes."""
    points = np.concatenate([page.positions for page in scene.pages])
    return projection_between(camera, *depth_range(model_view, points))


def projection_between(camera: Camera, near: float, far: float) -> np.ndarray:
    """[4, 4] projectionMatrix with given depth planes."""
    width, height = camera.size_px
    (fx, fy), (cx, cy) = camera.focal_px, camera.centre_px
    return np.array(
        [
            [2 * fx / width, 0, 1 - 2 * cx / width, 0],
            [0, 2 * fy / height, 2 * cy / height - 1, 0],
            [0, 0, -(far + near) / (far - near), -2 * far * near / (far - near)],
            [0, 0, -1, 0],
        ]
    )


def object_ray_from_ndc(model_view: np.ndarray, clip: np.ndarray) -> np.ndarray:
    """[3, 3]: direction = normalize(M (ndc.x, ndc.y, 1))."""
    view_ray = np.array(
        [[1 / clip[0, 0], 0, clip[0, 2] / clip[0, 0]], [0, 1 / clip[1, 1], clip[1, 2] / clip[1, 1]], [0, 0, -1]]
    )
    return np.linalg.inv(model_view[:3, :3]) @ view_ray


def depth_range(model_view: np.ndarray, points: np.ndarray) -> tuple[float, float]:
    """Near and far plane around everything of points [n, 3] that is in front of the camera."""
    depth = -(points @ model_view[2, :3] + model_view[2, 3])
    scale = np.cbrt(np.linalg.det(model_view[:3, :3]))
    nearest = NEAREST_SHARE * scale * np.linalg.norm(points.max(0) - points.min(0))
    near = max(0.99 * float(depth.min()), nearest)
    return near, max(1.01 * float(depth.max()), 2 * near)
