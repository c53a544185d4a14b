"""The fast renderer: the images of reference.py from Warp kernels, on CPU or CUDA."""

import numpy as np
import warp as wp

from core.baked import BakedScene, ShaderNetwork
from core.camera import Camera
from core.kernels.launch import launch
from core.render import raster_kernels as kernels
from core.render.visibility import NOTHING, SUBPIXELS_PER_SIDE, Visibility, subpixel_camera

MAX_SAMPLES = 1 << 22  # drawn at once (32 MB of keys); larger images are drawn in strips of rows
CPU_BANDS = 16  # bands of rows, each drawn by one thread


class Rasteriser:
    """Renders one scene from any camera. Uploads the scene once; not to be shared between threads.

    Args:
        scene: what to render.
        device: "cpu" or "cuda:N", see core.device.
        max_samples: bound on the samples drawn at once.
    """

    def __init__(self, scene: BakedScene, device: str = "cpu", *, max_samples: int = MAX_SAMPLES) -> None:
        self.scene, self.device, self.max_samples = scene, device, max_samples
        vertex_counts = [len(page.positions) for page in scene.pages]
        triangle_counts = [len(page.triangles) for page in scene.pages]
        self._first_triangle = np.cumsum([0, *triangle_counts])
        self._first_texel = np.cumsum([0, *(page.features_u8[..., 0].size for page in scene.pages)])
        self._bounds = scene.bounds()
        first_vertex = np.cumsum([0, *vertex_counts])
        triangles = [
            page.triangles.astype(np.int64) + start for page, start in zip(scene.pages, first_vertex, strict=False)
        ]
        self._positions = self._array(np.concatenate([page.positions for page in scene.pages]), wp.vec3d)
        self._weights = self._array(_packed_weights(scene.network), wp.float32)
        surface = kernels.Surface()
        surface.vertices = wp.empty(int(first_vertex[-1]), dtype=wp.vec3d, device=device)
        surface.triangles = self._array(np.concatenate(triangles), wp.vec3i)
        surface.texcoords = self._array(np.concatenate([page.texcoords for page in scene.pages]), wp.vec2f)
        surface.triangle_page = self._array(np.repeat(np.arange(len(scene.pages)), triangle_counts), wp.int32)
        surface.page_size = self._array(np.array([page.features_u8.shape[1::-1] for page in scene.pages]), wp.vec2i)
        surface.page_first = self._array(self._first_texel[:-1], wp.int32)
        surface.texels = self._array(_packed_texels(scene), wp.uint64)
        self._surface = surface
        self._boxes = wp.empty(int(self._first_triangle[-1]), dtype=wp.vec4i, device=device)

    def deferred(self, camera: Camera) -> np.ndarray:
        """The anti-aliased image, [h, w, 4] float32 in [0, 1], premultiplied by coverage: as `render_deferred`."""
        return self._image(camera, subpixel_camera(camera), SUBPIXELS_PER_SIDE)

    def forward(self, camera: Camera) -> np.ndarray:
        """One sample a pixel, [h, w, 4] float32: as `render_forward`."""
        return self._image(camera, camera, 1)

    def visibility(self, camera: Camera) -> Visibility:
        """What every pixel's centre sees. Pass `subpixel_camera(camera)` for the samples of the deferred image."""
        width, height = camera.size_px
        triangle, texel = np.full((2, height * width), NOTHING, np.int32)
        lens = self._look(camera)
        for first_row, rows in self._strips(camera, 1):
            keys = self._draw(lens, first_row, rows)
            outputs = [wp.empty(rows * width, dtype=int, device=self.device) for _ in range(2)]
            inputs = [self._surface, lens, first_row, keys, *outputs]
            launch(kernels.resolve, rows * width, inputs, self.device)
            part = slice(first_row * width, (first_row + rows) * width)
            triangle[part], texel[part] = (output.numpy() for output in outputs)
        return self._located(triangle.reshape(height, width), texel.reshape(height, width))

    def _image(self, camera: Camera, samples: Camera, side: int) -> np.ndarray:
        width, height = camera.size_px
        image = np.zeros((height, width, 4), np.float32)
        lens = self._look(samples)
        rotation = wp.mat33d(*samples.world_from_camera[:3, :3].ravel())
        for first_row, rows in self._strips(samples, side):
            keys = self._draw(lens, first_row, rows)
            pixels = wp.empty(rows // side * width, dtype=wp.vec4f, device=self.device)
            inputs = [self._surface, lens, first_row, side, keys, rotation, self._weights, pixels]
            launch(kernels.shade, len(pixels), inputs, self.device)
            image[first_row // side : (first_row + rows) // side] = pixels.numpy().reshape(-1, width, 4)
        return image

    def _look(self, camera: Camera) -> kernels.Lens:
        """Brings the vertices and their boxes into a camera's frame; its lens."""
        rotation = camera.world_from_camera[:3, :3]
        depths = (_corners(*self._bounds) - camera.position) @ -rotation[:, 2]
        nearest, deepest = max(float(depths.min()), 0.0), max(float(depths.max()), 0.0)
        lens = kernels.Lens()
        lens.focal, lens.centre = wp.vec2d(*camera.focal_px), wp.vec2d(*camera.centre_px)
        lens.width, lens.height = camera.size_px
        lens.nearest = wp.float64(nearest)
        steps_per_depth = kernels.DEPTH_STEPS.value / (deepest - nearest) if deepest > nearest else 0.0
        lens.depth_scale = wp.float64(steps_per_depth)
        inputs = [self._positions, wp.vec3d(*camera.position), wp.mat33d(*rotation.T.ravel()), self._surface.vertices]
        launch(kernels.to_camera_frame, len(self._positions), inputs, self.device)
        launch(kernels.find_boxes, len(self._boxes), [self._surface, lens, self._boxes], self.device)
        return lens

    def _strips(self, camera: Camera, side: int) -> list[tuple[int, int]]:
        """(first row, rows) of strips of the sample grid, in whole pixels of `side` rows, of at most max_samples."""
        width, height = camera.size_px
        step = max(self.max_samples // (width * side), 1) * side
        return [(first, min(step, height - first)) for first in range(0, height, step)]

    def _draw(self, lens: kernels.Lens, first_row: int, rows: int) -> wp.array:
        """The visibility buffer of a strip: rows * width keys."""
        keys = wp.full(rows * lens.width, kernels.EMPTY, dtype=wp.uint64, device=self.device)
        bands = CPU_BANDS if self.device == "cpu" else 1
        inputs = [self._surface, lens, self._boxes, first_row, rows, bands, keys]
        launch(kernels.draw, bands * len(self._boxes), inputs, self.device, parts=bands)
        return keys

    def _located(self, triangle: np.ndarray, texel: np.ndarray) -> Visibility:
        """Page by page indices from those among all pages."""
        page = (np.searchsorted(self._first_triangle, triangle, side="right") - 1).astype(np.int32)
        hit = triangle != NOTHING
        widths = np.array([page.features_u8.shape[1] for page in self.scene.pages])[page]
        local = texel - self._first_texel[page]
        parts = (triangle - self._first_triangle[page], local // widths, local % widths)
        return Visibility(
            np.where(hit, page, NOTHING).astype(np.int32), *(np.where(hit, p, 0).astype(np.int32) for p in parts)
        )

    def _array(self, values: np.ndarray, dtype: type) -> wp.array:
        return wp.array(values, dtype=dtype, device=self.device)


def _corners(low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """[8, 3]: the corners of a box."""
    return np.stack(np.meshgrid(*zip(low, high, strict=True), indexing="ij"), -1).reshape(-1, 3)


def _packed_texels(scene: BakedScene) -> np.ndarray:
    """[texels] uint64: all pages' texels, channel 0 in the lowest byte."""
    return np.concatenate([np.ascontiguousarray(page.features_u8).view("<u8").ravel() for page in scene.pages])


def _packed_weights(network: ShaderNetwork) -> np.ndarray:
    """float32: layer by layer, weights [columns, rows] and biases [rows], as the kernel `dense` reads them."""
    layers = zip(network.weights, network.biases, strict=True)
    return np.concatenate([part for w, b in layers for part in (w.T.ravel(), b)]).astype(np.float32)
