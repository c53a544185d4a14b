"""Shader programs of a network, per GLSL dialect. The interface is that of the extension POLYFIELD_materials_neural.

Attributes, uniforms, targets and state: docs/extensions/POLYFIELD_materials_neural/README.md, "Shader interface".
"""

from dataclasses import dataclass
from importlib import resources
from string import Template
from typing import Literal

from core.baked import ShaderNetwork
from exporters.glsl.network import network_function

Dialect = Literal["essl300", "glsl330"]
VERSIONS: dict[Dialect, str] = {"essl300": "300 es", "glsl330": "330 core"}
PROGRAMS = ("features", "shade", "forward")


@dataclass(frozen=True)
class Program:
    """Vertex and fragment text, without the version directive."""

    vertex: str
    fragment: str


@dataclass(frozen=True)
class ShaderSources:
    """The three programs in one dialect.

    Attributes:
        version: what follows `#version ` in front of every text, e.g. "300 es".
        features, shade: pass 1 and 2 of deferred rendering.
        forward: everything in one pass.
    """

    version: str
    features: Program
    shade: Program
    forward: Program

    def complete(self, program: str) -> Program:
        """A program ("features", "shade" or "forward") with the version directive, ready to be compiled."""
        source: Program = getattr(self, program)
        directive = f"#version {self.version}\n"
        return Program(directive + source.vertex, directive + source.fragment)


def shader_sources(network: ShaderNetwork, dialect: Dialect) -> ShaderSources:
    """The programs that show a scene with this network, in `dialect`: "essl300" or "glsl330"."""
    chunks = {
        # Desktop GLSL 3.30 has no precision of samplers, and no use for any precision.
        "precision": _template("precision.essl300.glsl") if dialect == "essl300" else "",
        "texel": _template("texel.glsl"),
        "network": network_function(network),
    }
    mesh_vertex = _filled("mesh.vert.glsl", chunks)
    return ShaderSources(
        VERSIONS[dialect],
        Program(mesh_vertex, _filled("features.frag.glsl", chunks)),
        Program(_filled("shade.vert.glsl", chunks), _filled("shade.frag.glsl", chunks)),
        Program(mesh_vertex, _filled("forward.frag.glsl", chunks)),
    )


def _filled(name: str, chunks: dict[str, str]) -> str:
    return Template(_template(name)).substitute(chunks)


def _template(name: str) -> str:
    return resources.files("exporters.glsl").joinpath("templates", name).read_text(encoding="utf-8")
