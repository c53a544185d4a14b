"""GLSL of a baked scene's shader network: one set of templates, GLSL ES 3.00 and desktop 3.30."""

from exporters.glsl.sources import PROGRAMS, VERSIONS, Dialect, Program, ShaderSources, shader_sources

__all__ = ["PROGRAMS", "VERSIONS", "Dialect", "Program", "ShaderSources", "shader_sources"]
