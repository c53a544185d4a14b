"""glTF's perspective camera of a capture's camera. The exact one is in the extension: glTF has no principal point."""

import math

import pygltflib as gltf

from core.camera import Camera

NEAR_SHARE = 1e-3  # of the scene's diagonal: close enough to fly in, far enough for a 24-bit depth buffer
SMALLEST_NEAR = 1e-30  # a scene without extent; glTF wants a number above zero, and viewers one that float32 can hold


def camera_json(camera: Camera, diagonal: float) -> gltf.Camera:
    """Field of view and aspect ratio of the camera; infinite far plane; `diagonal` is the scene's size in the asset."""
    width, height = camera.size_px
    fx, fy = camera.focal_px
    perspective = gltf.Perspective(
        yfov=2 * math.atan(height / 2 / fy),
        aspectRatio=(width / fx) / (height / fy),
        znear=max(NEAR_SHARE * diagonal, SMALLEST_NEAR),
    )
    return gltf.Camera(name=camera.name, type="perspective", perspective=perspective)
