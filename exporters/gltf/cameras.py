"""glTF's perspective camera of a capture's camera. The exact one is in the extension: glTF has no principal point."""

import math

import numpy as np
import pygltflib as gltf

from core.camera import Camera

NEAR_SHARE = 1e-3  # of the scene's diagonal: close enough to fly in, far enough for a 24-bit depth buffer


def camera_json(camera: Camera, diagonal: float) -> gltf.Camera:
    """Field of view and aspect ratio of the camera; infinite far plane; `diagonal` is the scene's size."""
    width, height = camera.size_px
    fx, fy = camera.focal_px
    perspective = gltf.Perspective(
        yfov=2 * math.atan(height / 2 / fy),
        aspectRatio=(width / fx) / (height / fy),
        znear=max(NEAR_SHARE * diagonal, 1e-6),
    )
    return gltf.Camera(name=camera.name, type="perspective", perspective=perspective)


def nearest_rigid(matrix: np.ndarray) -> np.ndarray:
    """[4, 4] with the rotation nearest to the matrix's (polar decomposition): glTF wants it closer than poses come."""
    u, _, vt = np.linalg.svd(matrix[:3, :3])
    rigid = np.eye(4)
    rigid[:3, :3] = u @ vt
    rigid[:3, 3] = matrix[:3, 3]
    return rigid
