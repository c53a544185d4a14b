"""The sample's renderer: a still life in a lit studio, photographed from anywhere."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
import warp as wp

import core.kernels  # noqa: F401  (starts Warp without its chatter)
from core.camera import Camera
from core.sample import kernels
from core.sample.design import design_of
from core.sample.still_life import TABLE_Z, still_life

SUBSAMPLES = 3  # 9 samples a pixel: a twig of 1.5 px keeps its coverage to within a few percent
LIGHTS = 192  # directional lights that stand for the studio; shadows are this many overlapping steps, seen as soft
BOUNCES = 2
EXPOSURE = 0.62
THREADS = 2
DEVICE = "cpu"


class Studio:
    """The still life of a seed with its light computed; rendering is thread-safe and reproducible."""

    def __init__(self, seed: int = 0, lights: int = LIGHTS) -> None:
        design = design_of(seed)
        mesh = still_life(design)
        self._positions: wp.array = wp.array(mesh.positions, dtype=wp.vec3, device=DEVICE)
        faces: wp.array = wp.array(mesh.faces.ravel(), dtype=wp.int32, device=DEVICE)
        self._mesh = wp.Mesh(self._positions, faces)
        scene: Any = kernels.Scene()
        scene.mesh = self._mesh.id
        scene.faces = faces
        scene.normals = wp.array(mesh.normals, dtype=wp.vec3, device=DEVICE)
        scene.uv = wp.array(mesh.uv, dtype=wp.vec2, device=DEVICE)
        scene.material = wp.array(mesh.material, dtype=wp.int32, device=DEVICE)
        scene.light = wp.zeros(len(mesh.positions), dtype=wp.vec3, device=DEVICE)
        scene.palette = wp.array(design.palette, dtype=wp.vec3, device=DEVICE)
        scene.seed, scene.rays, scene.table_z = design.seed, design.rays, TABLE_Z
        self._scene = scene
        self._light(lights)

    def photo(self, camera: Camera, subsamples: int = SUBSAMPLES) -> np.ndarray:
        """[height, width, 4] float32: premultiplied sRGB colour and coverage, in [0, 1]."""
        width, height = camera.size_px
        photo = wp.zeros((height, width), dtype=wp.vec4, device=DEVICE)
        inputs = [self._scene, *_lens(camera), subsamples, BOUNCES, EXPOSURE, photo]
        wp.launch(kernels.expose, (height, width), inputs, device=DEVICE)
        return photo.numpy()

    def depth(self, camera: Camera) -> np.ndarray:
        """[height, width] float32: distance along the ray through each pixel's centre; infinite beside the object."""
        width, height = camera.size_px
        depth = wp.zeros((height, width), dtype=wp.float32, device=DEVICE)
        wp.launch(kernels.measure_depth, (height, width), [self._scene, *_lens(camera), depth], device=DEVICE)
        return depth.numpy()

    def _light(self, lights: int) -> None:
        directions, radiances = _directional_lights(lights)
        inputs = [self._positions, wp.array(directions, dtype=wp.vec3), wp.array(radiances, dtype=wp.vec3)]
        edges = np.linspace(0, len(self._positions), 8 * THREADS + 1).astype(int)

        def part(first: int, last: int) -> None:
            wp.launch(kernels.light_vertices, last - first, [self._scene, *inputs, first], device=DEVICE)

        wp.load_module(kernels, device=DEVICE)
        with ThreadPoolExecutor(THREADS) as threads:
            list(threads.map(part, edges[:-1].tolist(), edges[1:].tolist()))


def _lens(camera: Camera) -> list[object]:
    rotation = wp.mat33(*camera.world_from_camera[:3, :3].ravel().tolist())
    return [wp.vec3(*camera.position.tolist()), rotation, wp.vec2(*camera.focal_px), wp.vec2(*camera.centre_px)]


def _directional_lights(count: int) -> tuple[np.ndarray, np.ndarray]:
    """Directions [count, 3] and radiance times solid angle / pi [count, 3] that stand for the whole studio.

    The sphere is walked along a space-filling curve and cut into pieces of equal brightness, so that the window, which
    casts the shadows, gets most of them.
    """
    fine = _along_curve(_fibonacci_sphere(60 * count))
    radiance = wp.zeros(len(fine), dtype=wp.vec3, device=DEVICE)
    inputs = [wp.array(fine, dtype=wp.vec3, device=DEVICE), radiance]
    wp.launch(kernels.look_around, len(fine), inputs, device=DEVICE)
    light = radiance.numpy().astype(np.float64) * 4.0 / len(fine)
    brightness = np.cumsum(light.sum(1))
    piece = np.minimum((brightness / brightness[-1] * count).astype(int), count - 1)
    directions, radiances = np.zeros((count, 3)), np.zeros((count, 3))
    np.add.at(directions, piece, fine * light.sum(1, keepdims=True))
    np.add.at(radiances, piece, light)
    return directions / np.linalg.norm(directions, axis=1, keepdims=True), radiances


def _fibonacci_sphere(count: int) -> np.ndarray:
    """[count, 3] unit directions, evenly spread."""
    z = 1 - (2 * np.arange(count) + 1) / count
    angle = np.arange(count) * np.pi * (3 - np.sqrt(5))
    radius = np.sqrt(1 - z * z)
    return np.stack([radius * np.cos(angle), radius * np.sin(angle), z], -1)


def _along_curve(directions: np.ndarray, bits: int = 7) -> np.ndarray:
    """The directions in Morton order of their octahedral map, so that neighbours in the list are close in space."""
    flat = directions[:, :2] / np.abs(directions).sum(1, keepdims=True)
    folded = (1 - np.abs(flat[:, ::-1])) * np.where(flat >= 0, 1, -1)
    flat = np.where(directions[:, 2:] >= 0, flat, folded)
    cell = np.clip((flat + 1) / 2 * (1 << bits), 0, (1 << bits) - 1).astype(int)
    code = sum(((cell[:, axis] >> bit) & 1) << (2 * bit + axis) for bit in range(bits) for axis in range(2))
    return directions[np.argsort(code, kind="stable")]
