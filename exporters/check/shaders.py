"""The shader texts: are they there, do they compile, and are they those of the weights."""

from typing import Any, get_args

from core.baked import ShaderNetwork
from exporters.check.compiler import Compiler
from exporters.check.finding import Finding, Findings
from exporters.glsl import PROGRAMS, VERSIONS, Dialect, ShaderSources, shader_sources
from exporters.gltf import extension

# What the extension's README promises of each program, by the words that must be in its texts.
INTERFACE = {
    "features": ("position", "uv", "modelViewMatrix", "projectionMatrix", "u_features0", "u_features1", "o_features1"),
    "shade": ("position", "u_features0", "u_features1", "u_object_ray_from_ndc", "o_color"),
    "forward": ("position", "uv", "modelViewMatrix", "projectionMatrix", "u_camera_position_object", "o_color"),
}


def check_shaders(found: Findings, json: dict[str, Any], network: ShaderNetwork, compiler: Compiler | None) -> None:
    """Adds what is wrong with the texts in a network's JSON.

    Raises:
        KeyError, TypeError, ValueError for JSON of another structure.
    """
    shaders = extension.shaders_from_json(json)
    for dialect in get_args(Dialect):
        if dialect not in shaders:
            found.error("shader", dialect, "must be among the shaders: viewers compile this dialect")
            continue
        broken = _check_dialect(found, dialect, shaders[dialect], compiler)
        if not broken and shaders[dialect] != shader_sources(network, dialect):
            found.warning("shader", dialect, "is not the text that Polyfield makes of these weights: may show others")
    if shaders and compiler is None:
        found.append(Finding("note", "shader", "shaders", "were not compiled: moderngl or OpenGL is missing here"))


def _check_dialect(found: Findings, dialect: Dialect, sources: ShaderSources, compiler: Compiler | None) -> bool:
    """Whether anything is wrong."""
    before = len(found)
    if sources.version != VERSIONS[dialect]:
        found.error("shader", dialect, f"must have version {VERSIONS[dialect]}, but got {sources.version[:20]}")
    for name in PROGRAMS:
        program = sources.complete(name)
        text = program.vertex + program.fragment
        missing = [word for word in INTERFACE[name] if word not in text]
        if missing:
            found.error("shader", f"{dialect}, {name}", f"must use {', '.join(missing)}, as the interface says")
        problem = compiler(program.vertex, program.fragment) if compiler else ""
        if problem:
            found.error("shader", f"{dialect}, {name}", f"must compile, but the driver says: {problem[:400]}")
    return len(found) > before
