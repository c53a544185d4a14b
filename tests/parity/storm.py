"""A stand-in for Storm, which OpenUSD's packages on PyPI lack: runs a glslfx surface shader in OpenGL.

The accessors are those that Storm generates for a material's inputs, as far as a surface shader may use them.
"""

import json
import re
from dataclasses import dataclass
from typing import Any

from pxr import UsdShade

VERTEX = """#version 330 core
uniform mat4 u_transform, u_view, u_projection;
in vec3 position;
in vec2 st;
out vec4 v_eye;
out vec2 v_st;
void main() {
    v_st = st;
    v_eye = u_view * (u_transform * vec4(position, 1.0));
    gl_Position = u_projection * v_eye;
}
"""
PREAMBLE = """#version 330 core
#define MAT4 mat4
uniform mat4 u_transform, u_view, u_projection;
in vec4 v_eye;
in vec2 v_st;
out vec4 o_color;
mat4 HdGet_transform() { return u_transform; }
mat4 ApplyInstanceTransform(mat4 transform) { return transform; }
mat4 GetWorldToViewMatrix() { return u_view; }
mat4 GetProjectionMatrix() { return u_projection; }
"""
MAIN = """
void main() {
    vec4 color = surfaceShader(v_eye, vec3(0.0, 0.0, 1.0), vec4(1.0), vec4(0.0));
    if (color.a < 0.5) discard;  // material tag "masked"
    o_color = color;
}
"""
OUTPUTS = {"rgb": ("vec3", "rgb"), "a": ("float", "a")}


@dataclass(frozen=True)
class StormShader:
    """Vertex and fragment shader, and the prims of the textures by sampler name."""

    vertex: str
    fragment: str
    textures: dict[str, Any]


def storm_shader(material: UsdShade.Material) -> StormShader:
    """The shader of a material's `glslfx` output."""
    surface = material.ComputeSurfaceSource("glslfx")[0]
    configuration, sections = parsed(surface.GetSourceCode("glslfx"))
    assert configuration["metadata"]["materialTag"] == "masked"
    (name,) = configuration["techniques"]["default"]["surfaceShader"]["source"]
    accessors, textures = [], {}
    for attribute, content in configuration["attributes"].items():
        accessors.append(f"{content['type']} HdGet_{attribute}() {{ return v_{attribute}; }}")
    for parameter in configuration["parameters"]:
        value = surface.GetInput(parameter).Get()
        accessors.append(f"vec{len(value)} HdGet_{parameter}() {{ return vec{len(value)}{tuple(value)}; }}")
    for texture in configuration["textures"]:
        source = surface.GetInput(texture).GetConnectedSources()[0][0]
        kind, swizzle = OUTPUTS[source.sourceName]
        sampler = f"sampler2d_{source.source.GetPrim().GetName()}"
        accessors.append(f"{kind} HdGet_{texture}(vec2 st) {{ return texture({sampler}, st).{swizzle}; }}")
        textures[sampler] = source.source.GetPrim()
    samplers = "".join(f"uniform sampler2D {sampler};\n" for sampler in textures)
    fragment = PREAMBLE + samplers + "\n".join(accessors) + "\n" + sections[name] + MAIN
    return StormShader(VERTEX, fragment, textures)


def parsed(source: str) -> tuple[dict[str, Any], dict[str, str]]:
    """Configuration and GLSL sections by name of a glslfx text."""
    first, *parts = re.split(r"^-- ", source, flags=re.MULTILINE)
    assert first == ""
    assert parts[0].startswith("glslfx version 0.1")
    head, body = parts[1].split("\n", 1)
    assert head == "configuration"
    sections = {}
    for part in parts[2:]:
        head, text = part.split("\n", 1)
        sections[head.removeprefix("glsl ").strip()] = text
    return json.loads(body), sections
