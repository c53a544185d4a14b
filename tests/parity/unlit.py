"""Draws a .glb as a viewer does that knows nothing of its extension: loaded by trimesh, unlit, in OpenGL."""

import io
from dataclasses import dataclass
from typing import Any

import moderngl
import numpy as np
import trimesh

from core.camera import Camera
from exporters.gltf.document import Document
from tests.parity.gl_matrices import depth_range, projection_between, view_from_object

UNLIT = "KHR_materials_unlit"
FILTERS = {9728: moderngl.NEAREST, 9729: moderngl.LINEAR}
VERTEX = """#version 330 core
uniform mat4 u_view, u_projection;
in vec3 position;
in vec2 uv;
out vec2 v_uv;
void main() {
    v_uv = uv;
    gl_Position = u_projection * (u_view * vec4(position, 1.0));
}
"""
FRAGMENT = """#version 330 core
uniform sampler2D u_color;
uniform float u_cutoff;
in vec2 v_uv;
out vec4 o_color;
void main() {
    vec4 color = texture(u_color, v_uv);
    if (color.a < u_cutoff) discard;
    o_color = vec4(color.rgb, 1.0);
}
"""


@dataclass(frozen=True)
class _Draw:
    vertices: moderngl.VertexArray
    texture: moderngl.Texture
    cutoff: float


class UnlitRenderer:
    """The fallback of one .glb on one OpenGL context. No mip maps."""

    def __init__(self, context: moderngl.Context, glb: bytes) -> None:
        document = Document.of_glb(glb).json
        assert all(UNLIT in material["extensions"] for material in document["materials"])
        (self._filter,) = {FILTERS[sampler["magFilter"]] for sampler in document["samplers"]}
        self._context = context
        self._program = context.program(vertex_shader=VERTEX, fragment_shader=FRAGMENT)
        meshes = trimesh.load_scene(io.BytesIO(glb), file_type="glb", process=False).dump()
        self._points = np.concatenate([mesh.vertices for mesh in meshes])
        self._draws = [self._prepared(mesh) for mesh in meshes]

    def render(self, camera: Camera) -> np.ndarray:
        """[h, w, 4] float64 in [0, 1]: colour (sRGB) and coverage, one sample a pixel, row 0 at the top.

        `camera` is in the asset's frame.
        """
        view = view_from_object(camera, None)
        self._program["u_view"].write(view.T.astype("f4").tobytes())
        clip = projection_between(camera, *depth_range(view, self._points))
        self._program["u_projection"].write(clip.T.astype("f4").tobytes())
        colors, depth = self._context.texture(camera.size_px, 4), self._context.depth_renderbuffer(camera.size_px)
        target = self._context.framebuffer([colors], depth)
        target.use()
        target.clear()
        self._context.enable_only(moderngl.DEPTH_TEST)
        for draw in self._draws:
            draw.texture.use(0)
            self._program["u_cutoff"].value = draw.cutoff
            draw.vertices.render()
        width, height = camera.size_px
        image = np.frombuffer(target.read(components=4, alignment=1), np.uint8).reshape(height, width, 4)
        return image[::-1] / 255.0

    def _prepared(self, mesh: Any) -> _Draw:
        """A mesh in the asset's frame; trimesh's texture coordinates start at the bottom left."""
        image = mesh.visual.material.baseColorTexture.convert("RGBA")
        texture = self._context.texture(image.size, 4, np.asarray(image)[::-1].tobytes())
        texture.filter = (self._filter, self._filter)
        texture.repeat_x = texture.repeat_y = False
        content = [
            (self._context.buffer(np.asarray(mesh.vertices, "f4").tobytes()), "3f", "position"),
            (self._context.buffer(np.asarray(mesh.visual.uv, "f4").tobytes()), "2f", "uv"),
        ]
        indices = self._context.buffer(np.asarray(mesh.faces, "u4").tobytes())
        assert mesh.visual.material.alphaMode == "MASK"
        cutoff = mesh.visual.material.alphaCutoff
        return _Draw(
            self._context.vertex_array(self._program, content, indices, 4), texture, 0.5 if cutoff is None else cutoff
        )
