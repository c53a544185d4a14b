"""The reference renderer: what a baked scene looks like, by definition. Slow, readable, float64, NumPy only.

Every other renderer (raster.py, the shaders) is tested against this one.

Visibility is by homogeneous ray-triangle tests: with the camera at the origin, a ray direction d meets the plane of
(v0, v1, v2) at t d, where t = det(v0, v1, v2) / (b0 + b1 + b2) and b0 = d.(v1 x v2), b1 = d.(v2 x v0),
b2 = d.(v0 x v1) are proportional to the barycentric coordinates. The ray hits the triangle where the three have the
same sign and t > 0. Nothing is projected, so nothing has to be clipped, and interpolation is perspective-correct.
"""

from collections.abc import Iterator

import numpy as np

from core.baked import BakedScene
from core.camera import Camera
from core.conventions import is_opaque
from core.render.visibility import NOTHING, SUBPIXELS_PER_SIDE, Visibility, subpixel_camera


def render_deferred(scene: BakedScene, camera: Camera) -> np.ndarray:
    """The anti-aliased image of conventions.SUBPIXEL_OFFSETS_PX.

    A pixel's features are the mean over its covered sub-pixels; the network runs once, with the ray through the pixel's
    centre.

    Returns:
        [height, width, 4] float64 in [0, 1]: colour premultiplied by coverage, coverage.
    """
    seen = visibility(scene, subpixel_camera(camera))
    total = _pixel_sums(seen.features(scene))
    covered = _pixel_sums(seen.hit[..., None].astype(np.float64))
    colors = scene.network(total / np.maximum(covered, 1.0), camera.directions(camera.pixel_centres()))
    coverage = covered / SUBPIXELS_PER_SIDE**2
    return np.concatenate([colors * coverage, coverage], -1)


def render_forward(scene: BakedScene, camera: Camera) -> np.ndarray:
    """One sample at each pixel's centre; coverage is 0 or 1. Shape and range as `render_deferred`."""
    seen = visibility(scene, camera)
    colors = scene.network(seen.features(scene), camera.directions(camera.pixel_centres()))
    coverage = seen.hit[..., None].astype(np.float64)
    return np.concatenate([colors * coverage, coverage], -1)


def visibility(scene: BakedScene, camera: Camera) -> Visibility:
    """The nearest opaque texel behind every pixel centre; of equally near ones the first in page and triangle order."""
    width, height = camera.size_px
    rays = _camera_rays(camera)
    nearest = np.full((height, width), np.inf)
    page, triangle, row, column = np.full((4, height, width), NOTHING, np.int32)
    for page_index, content in enumerate(scene.pages):
        vertices = (content.positions.astype(np.float64) - camera.position) @ camera.world_from_camera[:3, :3]
        corners = vertices[content.triangles]
        normals = _edge_normals(corners)
        texcoords = content.texcoords.astype(np.float64)[content.triangles]
        opaque = is_opaque(content.features_u8)
        size = np.array([opaque.shape[1], opaque.shape[0]])
        for index, box in _pixel_boxes(corners, camera):
            depth, barycentric = _intersect(rays[box], corners[index], normals[index])
            hit = depth < nearest[box]
            texel = np.clip(np.floor(barycentric[hit] @ texcoords[index] * size), 0, size - 1).astype(np.int32)
            solid = opaque[texel[:, 1], texel[:, 0]]
            hit[hit], texel = solid, texel[solid]
            nearest[box][hit] = depth[hit]
            page[box][hit], triangle[box][hit] = page_index, index
            row[box][hit], column[box][hit] = texel[:, 1], texel[:, 0]
    hit = page != NOTHING
    return Visibility(page, *(np.where(hit, values, 0) for values in (triangle, row, column)))


def _camera_rays(camera: Camera) -> np.ndarray:
    """[h, w, 3]: rays through the pixel centres in the camera frame, scaled so that t is the depth (z = -1)."""
    offset = (camera.pixel_centres() - camera.centre_px) / camera.focal_px
    return np.stack([offset[..., 0], -offset[..., 1], -np.ones(offset.shape[:2])], -1)


def _edge_normals(corners: np.ndarray) -> np.ndarray:
    """[T, 3, 3] of corners [T, 3, 3]: v1 x v2, v2 x v0, v0 x v1 as rows."""
    return np.cross(np.roll(corners, -1, 1), np.roll(corners, -2, 1))


def _intersect(rays: np.ndarray, corners: np.ndarray, normals: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Depth [h, w] (infinite where missed) and barycentric coordinates of rays [h, w, 3] on one triangle's plane."""
    b = rays @ normals.T
    total = b.sum(-1)
    inside = (b >= 0).all(-1) | (b <= 0).all(-1)
    with np.errstate(divide="ignore", invalid="ignore"):
        depth = np.where(inside, (corners[0] @ normals[0]) / total, np.inf)  # NaN, so not a hit, where both are 0
        barycentric = b / total[..., None]
    return np.where(depth > 0, depth, np.inf), barycentric


def _pixel_boxes(corners: np.ndarray, camera: Camera) -> Iterator[tuple[int, tuple[slice, slice]]]:
    """(triangle, (rows, columns)) for every triangle of [T, 3, 3] that may be seen: the pixels it may cover.

    The box is that of the projected corners; the whole image where a corner is not in front of the camera.
    """
    width, height = camera.size_px
    depth = -corners[..., 2]
    in_front = np.all(depth > 0, axis=-1)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        x = camera.centre_px[0] + camera.focal_px[0] * corners[..., 0] / depth
        y = camera.centre_px[1] - camera.focal_px[1] * corners[..., 1] / depth
    # A pixel's centre is at + 0.5; the margin of a pixel either side keeps rounding out of the question.
    left, right = _pixel_range(x, in_front, width)
    top, bottom = _pixel_range(y, in_front, height)
    visible = np.any(depth > 0, axis=-1) & (left < right) & (top < bottom)
    for index in np.flatnonzero(visible):
        yield int(index), (slice(top[index], bottom[index]), slice(left[index], right[index]))


def _pixel_range(projected: np.ndarray, valid: np.ndarray, size: int) -> tuple[np.ndarray, np.ndarray]:
    """First and one past the last pixel, [T] each, of triangles whose corners project to [T, 3]; all if not valid."""
    low = np.where(valid, projected.min(-1), 0.0)
    high = np.where(valid, projected.max(-1), size)
    return (
        np.clip(np.floor(low) - 1, 0, size).astype(int),
        np.clip(np.ceil(high) + 1, 0, size).astype(int),
    )


def _pixel_sums(samples: np.ndarray) -> np.ndarray:
    """[h, w, c]: sums over the sub-pixels of samples [s h, s w, c]."""
    height, width, channels = samples.shape
    s = SUBPIXELS_PER_SIDE
    return samples.reshape(height // s, s, width // s, s, channels).sum((1, 3))
