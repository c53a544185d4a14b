"""Draws USD files in OpenGL as a renderer would: mesh and textures through pxr, GLSL of one of the three outputs."""

import io
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, Literal

import moderngl
import numpy as np
from PIL import Image
from pxr import Ar, Usd, UsdGeom, UsdShade

from core.camera import Camera
from tests.parity.gl_matrices import depth_range, projection_between, view_from_object
from tests.parity.storm import storm_shader
from tests.parity.usd_materialx import generated_glsl

Look = Literal["storm", "materialx", "preview"]

PREVIEW_VERTEX = """#version 330 core
uniform mat4 u_transform, u_view, u_projection;
in vec3 position;
in vec2 st;
out vec2 v_st;
void main() {
    v_st = st;
    gl_Position = u_projection * (u_view * (u_transform * vec4(position, 1.0)));
}
"""
# The texture is uploaded as sRGB, so that filtering is linear as UsdPreviewSurface asks; then back for the screen.
PREVIEW_FRAGMENT = """#version 330 core
uniform sampler2D u_color;
uniform float u_threshold;
in vec2 v_st;
out vec4 o_color;
void main() {
    vec4 color = texture(u_color, v_st);
    if (color.a < u_threshold) discard;
    o_color = vec4(color.rgb, 1.0);
}
"""


class UsdRenderer:
    """The files of one USD asset on one OpenGL context.

    Args:
        folder: where `files` can be put, as a renderer finds them.
        look: which of the material's outputs to draw.
        smooth: whether textures are interpolated between texels; no mip maps.
    """

    def __init__(
        self,
        context: moderngl.Context,
        files: Mapping[str, bytes],
        folder: Path,
        look: Look,
        smooth: bool = False,
    ) -> None:
        self.context = context
        self.filter = moderngl.LINEAR if smooth else moderngl.NEAREST
        for name, data in files.items():
            (folder / name).write_bytes(data)
        (layer,) = [name for name in files if Path(name).suffix in (".usdc", ".usda", ".usdz")]
        self.stage = Usd.Stage.Open(str(folder / layer))
        self._draws = [self._prepared(UsdGeom.Mesh(p), look) for p in self.stage.Traverse() if p.IsA(UsdGeom.Mesh)]

    def render(self, camera: Camera) -> np.ndarray:
        """[h, w, 4] float64 in [0, 1] (of 8 bits): colour (sRGB) and coverage, one sample a pixel, row 0 at the top.

        `camera` is in the stage's frame.
        """
        view = view_from_object(camera, None)
        clip = projection_between(camera, *depth_range(view, self._points()))
        target = self.context.framebuffer(
            [self.context.texture(camera.size_px, 4, dtype="f4")], self.context.depth_renderbuffer(camera.size_px)
        )
        target.use()
        target.clear()
        self.context.enable_only(moderngl.DEPTH_TEST)
        for draw in self._draws:
            draw(view, clip)
        width, height = camera.size_px
        linear = np.frombuffer(target.read(components=4, dtype="f4"), np.float32).reshape(height, width, 4)[::-1]
        return np.concatenate([np.rint(255 * encoded(linear[..., :3])) / 255, linear[..., 3:]], -1).astype(np.float64)

    def _points(self) -> np.ndarray:
        return np.concatenate(
            [
                np.array(UsdGeom.Mesh(prim).GetPointsAttr().Get(), float) @ (m := _world(prim))[:3, :3].T + m[:3, 3]
                for prim in self.stage.Traverse()
                if prim.IsA(UsdGeom.Mesh)
            ]
        )

    def _prepared(self, mesh: UsdGeom.Mesh, look: Look) -> Callable[[np.ndarray, np.ndarray], None]:
        material = UsdShade.MaterialBindingAPI(mesh).ComputeBoundMaterial()[0]
        return {"storm": self._storm, "materialx": self._materialx, "preview": self._preview}[look](mesh, material)

    def _storm(self, mesh: UsdGeom.Mesh, material: UsdShade.Material) -> Callable[[np.ndarray, np.ndarray], None]:
        shader = storm_shader(material)
        program = self.context.program(vertex_shader=shader.vertex, fragment_shader=shader.fragment)
        textures = {name: self._texture(UsdShade.Shader(prim)) for name, prim in shader.textures.items()}
        return self._hydra_draw(program, mesh, textures)

    def _preview(self, mesh: UsdGeom.Mesh, material: UsdShade.Material) -> Callable[[np.ndarray, np.ndarray], None]:
        surface = material.ComputeSurfaceSource()[0]
        assert surface.GetIdAttr().Get() == "UsdPreviewSurface"
        assert (*surface.GetInput("diffuseColor").Get(), surface.GetInput("metallic").Get()) == (0, 0, 0, 1)
        sources = [surface.GetInput(name).GetConnectedSources()[0][0] for name in ("emissiveColor", "opacity")]
        assert [source.sourceName for source in sources] == ["rgb", "a"]
        program = self.context.program(vertex_shader=PREVIEW_VERTEX, fragment_shader=PREVIEW_FRAGMENT)
        program["u_threshold"].value = surface.GetInput("opacityThreshold").Get()
        texture = self._texture(UsdShade.Shader(sources[0].source.GetPrim()))
        return self._hydra_draw(program, mesh, {"u_color": texture})

    def _hydra_draw(
        self, program: moderngl.Program, mesh: UsdGeom.Mesh, textures: dict[str, moderngl.Texture]
    ) -> Callable[[np.ndarray, np.ndarray], None]:
        vertices = self._vertices(program, mesh, "position", "st")
        transform = _world(mesh.GetPrim())

        def draw(view: np.ndarray, clip: np.ndarray) -> None:
            _write(program, u_transform=transform, u_view=view, u_projection=clip)
            _bind(program, textures)
            vertices.render()

        return draw

    def _materialx(self, mesh: UsdGeom.Mesh, material: UsdShade.Material) -> Callable[[np.ndarray, np.ndarray], None]:
        vertex, fragment = generated_glsl(material)
        program = self.context.program(vertex_shader=vertex, fragment_shader=fragment)
        graph = material.GetPath().AppendChild("network")
        textures = {
            f"{name}_file": self._texture(UsdShade.Shader(self.stage.GetPrimAtPath(graph.AppendChild(name))))
            for name in ("features0", "features1")
        }
        # As bright as a screen's white from everywhere: nothing of it may be reflected.
        white = self.context.texture((1, 1), 4, np.ones(4, "f4").tobytes(), dtype="f4")
        textures |= {name: white for name in ("u_envRadiance", "u_envIrradiance") if name in program}
        vertices = self._vertices(program, mesh, "i_position", "i_geomprop_st")
        transform = _world(mesh.GetPrim())

        def draw(view: np.ndarray, clip: np.ndarray) -> None:
            _write(
                program,
                u_worldMatrix=transform,
                u_worldInverseMatrix=np.linalg.inv(transform),
                u_viewProjectionMatrix=clip @ view,
                u_viewPosition=np.linalg.inv(view)[:3, 3],
            )
            _bind(program, textures)
            vertices.render()

        return draw

    def _vertices(self, program: moderngl.Program, mesh: UsdGeom.Mesh, position: str, st: str) -> moderngl.VertexArray:
        assert set(mesh.GetFaceVertexCountsAttr().Get()) == {3}
        points = np.array(mesh.GetPointsAttr().Get(), "f4")
        coordinates = np.array(UsdGeom.PrimvarsAPI(mesh).GetPrimvar("st").Get(), "f4")
        indices = np.array(mesh.GetFaceVertexIndicesAttr().Get(), "u4")
        content = [
            (self.context.buffer(points.tobytes()), "3f", position),
            (self.context.buffer(coordinates.tobytes()), "2f", st),
        ]
        # Any: nothing may depend on them.
        for name, vector in (("i_normal", (0.0, 0.0, 1.0)), ("i_tangent", (1.0, 0.0, 0.0))):
            if name in program:
                content.append(
                    (self.context.buffer(np.tile(np.array(vector, "f4"), len(points)).tobytes()), "3f", name)
                )
        return self.context.vertex_array(program, content, self.context.buffer(indices.tobytes()), 4)

    def _texture(self, node: UsdShade.Shader) -> moderngl.Texture:
        """As UsdUVTexture and MaterialX say: (0, 0) is the bottom left corner; nothing premultiplied."""
        asset = node.GetInput("file").Get()
        image = Image.open(io.BytesIO(_bytes_of(asset))).convert("RGBA")
        upright = np.array(image)[::-1]
        space = node.GetInput("sourceColorSpace")
        srgb = space and space.Get() == "sRGB"
        internal = {"internal_format": 0x8C43} if srgb else {}  # SRGB8_ALPHA8
        texture = self.context.texture(image.size, 4, upright.tobytes(), **internal)
        texture.filter = (self.filter, self.filter)
        texture.repeat_x = texture.repeat_y = False
        return texture


def encoded(linear: np.ndarray) -> np.ndarray:
    """sRGB in [0, 1] of linear colour."""
    linear = np.clip(linear, 0, 1)
    return np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)


def _bytes_of(asset: Any) -> bytes:
    opened = Ar.GetResolver().OpenAsset(Ar.ResolvedPath(asset.resolvedPath))
    return bytes(opened.GetBuffer())


def _world(prim: Usd.Prim) -> np.ndarray:
    return np.array(UsdGeom.XformCache().GetLocalToWorldTransform(prim)).T


def _write(program: moderngl.Program, **uniforms: np.ndarray) -> None:
    """Sets the uniforms that the compiler has kept."""
    for name, value in uniforms.items():
        if name in program:
            program[name].write(np.ascontiguousarray(np.asarray(value).T, "f4").tobytes())


def _bind(program: moderngl.Program, textures: dict[str, moderngl.Texture]) -> None:
    for unit, (name, texture) in enumerate(textures.items()):
        texture.use(unit)
        program[name].value = unit
