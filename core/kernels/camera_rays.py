"""Rays through pixels."""

import warp as wp

wp.set_module_options({"enable_backward": False})


@wp.struct
class CameraArray:
    focal_px: wp.array(dtype=wp.vec2)
    centre_px: wp.array(dtype=wp.vec2)
    rotation: wp.array(dtype=wp.mat33)
    position: wp.array(dtype=wp.vec3)


@wp.kernel
def camera_rays(
    first: int,
    cameras: CameraArray,
    image: wp.array(dtype=wp.int32),
    point_px: wp.array(dtype=wp.vec2),
    offsets_px: wp.array(dtype=wp.vec2),
    origins: wp.array(dtype=wp.vec3),
    directions: wp.array(dtype=wp.vec3),
):
    """Rays [count * offsets] of image points [count], each moved by every offset; see Camera.directions."""
    i = first + wp.tid()
    c = image[i]
    for s in range(offsets_px.shape[0]):
        xy = point_px[i] + offsets_px[s] - cameras.centre_px[c]
        focal = cameras.focal_px[c]
        camera = wp.vec3(xy[0] / focal[0], -xy[1] / focal[1], -1.0)
        r = i * offsets_px.shape[0] + s
        origins[r] = cameras.position[c]
        directions[r] = wp.normalize(cameras.rotation[c] * camera)
