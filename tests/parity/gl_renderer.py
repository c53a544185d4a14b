"""Runs a .glb's own shader text in OpenGL as the extension's README says: a second opinion on the reference."""

from typing import Literal, NamedTuple

import moderngl
import numpy as np

from core.baked import Page
from core.camera import Camera
from exporters.glsl import PROGRAMS, Dialect, ShaderSources
from exporters.gltf import read_glb, read_shaders
from tests.parity.gl_matrices import object_ray_from_ndc, projection, view_from_object

Mode = Literal["deferred", "forward"]
SUPERSAMPLING = 2
RGBA = 4
SCREEN_TRIANGLE = np.array([[-1, -1, 0], [3, -1, 0], [-1, 3, 0]], "f4")


class _GlPage(NamedTuple):
    """A page on the GPU."""

    textures: tuple[moderngl.Texture, moderngl.Texture]
    vertices: list[tuple[moderngl.Buffer, str, str]]
    indices: moderngl.Buffer


class GlRenderer:
    """One .glb on one OpenGL context.

    Args:
        context: a moderngl context; whatever is made here lives as long as it.
        glb: the file.
        dialect: which of the asset's shader texts to run.
        shaders: other texts to run in place of the asset's.
    """

    def __init__(
        self, context: moderngl.Context, glb: bytes, dialect: Dialect = "glsl330", shaders: ShaderSources | None = None
    ) -> None:
        self.context = context
        self.scene = read_glb(glb)
        sources = shaders or read_shaders(glb)[dialect]
        self._programs = {name: self._program(sources, name) for name in PROGRAMS}
        self._pages = [self._upload(page) for page in self.scene.pages]

    def render(self, camera: Camera, mode: Mode, world_from_object: np.ndarray | None = None) -> np.ndarray:
        """[h, w, 4] float64 in [0, 1] (of 8 bits): premultiplied colour and coverage, row 0 at the top.

        `camera` is in the world frame; `world_from_object` ([4, 4], rotation, translation, uniform scale) places the
        object there; identity if None.
        """
        model_view = view_from_object(camera, world_from_object)
        clip = projection(camera, model_view, self.scene)
        if mode == "forward":
            position = np.linalg.inv(model_view)[:3, 3]
            target = self._draw_meshes(
                "forward", camera.size_px, 1, model_view, clip, u_camera_position_object=position
            )
        else:
            width, height = camera.size_px
            double_size = (SUPERSAMPLING * width, SUPERSAMPLING * height)
            features = self._draw_meshes("features", double_size, 2, model_view, clip)
            target = self._draw_screen(features, camera.size_px, object_ray_from_ndc(model_view, clip))
        return _read(target) / 255.0

    def render_features(self, camera: Camera) -> np.ndarray:
        """[2h, 2w, 8] uint8: what pass 1 leaves in its two targets, row 0 at the top."""
        model_view = view_from_object(camera, None)
        size = (SUPERSAMPLING * camera.size_px[0], SUPERSAMPLING * camera.size_px[1])
        target = self._draw_meshes("features", size, 2, model_view, projection(camera, model_view, self.scene))
        return np.concatenate([_read(target, 0), _read(target, 1)], -1)

    def _program(self, sources: ShaderSources, name: str) -> moderngl.Program:
        text = sources.complete(name)
        return self.context.program(vertex_shader=text.vertex, fragment_shader=text.fragment)

    def _upload(self, page: Page) -> _GlPage:
        height, width = page.features_u8.shape[:2]
        halves = (page.features_u8[..., :4], page.features_u8[..., 4:])
        first, second = (self.context.texture((width, height), RGBA, half.tobytes()) for half in halves)
        return _GlPage(
            (first, second),
            [
                (self.context.buffer(page.positions.astype("f4").tobytes()), "3f", "position"),
                (self.context.buffer(page.texcoords.astype("f4").tobytes()), "2f", "uv"),
            ],
            self.context.buffer(page.triangles.astype("u4").tobytes()),
        )

    def _draw_meshes(
        self,
        name: str,
        size: tuple[int, int],
        targets: int,
        model_view: np.ndarray,
        clip: np.ndarray,
        **uniforms: np.ndarray,
    ) -> moderngl.Framebuffer:
        """All pages into fresh RGBA8 targets with a depth buffer."""
        program = self._programs[name]
        _write(program, modelViewMatrix=model_view, projectionMatrix=clip, **uniforms)
        target = self.context.framebuffer(
            [self.context.texture(size, RGBA) for _ in range(targets)], self.context.depth_renderbuffer(size)
        )
        target.use()
        target.clear()
        self.context.enable_only(moderngl.DEPTH_TEST)
        for page in self._pages:
            _bind(program, page.textures)
            self.context.vertex_array(program, page.vertices, page.indices, index_element_size=4).render()
        return target

    def _draw_screen(
        self, features: moderngl.Framebuffer, size: tuple[int, int], ray: np.ndarray
    ) -> moderngl.Framebuffer:
        """Pass 2 of deferred rendering."""
        program = self._programs["shade"]
        _write(program, u_object_ray_from_ndc=ray)
        _bind(program, features.color_attachments)
        target = self.context.framebuffer([self.context.texture(size, RGBA)])
        target.use()
        self.context.enable_only(moderngl.NOTHING)
        triangle = self.context.buffer(SCREEN_TRIANGLE.tobytes())
        self.context.vertex_array(program, [(triangle, "3f", "position")]).render()
        return target


def _write(program: moderngl.Program, **uniforms: np.ndarray) -> None:
    """Sets uniforms; matrices are transposed to GL's column order."""
    for name, value in uniforms.items():
        program[name].write(np.ascontiguousarray(value.T, "f4").tobytes())


def _bind(program: moderngl.Program, textures: tuple[moderngl.Texture, ...]) -> None:
    for unit, texture in enumerate(textures):
        texture.use(unit)
        program[f"u_features{unit}"].value = unit


def _read(target: moderngl.Framebuffer, attachment: int = 0) -> np.ndarray:
    """[h, w, 4] uint8, row 0 at the top: GL's first row is the bottom one."""
    width, height = target.size
    raw = target.read(components=RGBA, attachment=attachment, alignment=1)
    return np.frombuffer(raw, np.uint8).reshape(height, width, RGBA)[::-1]
