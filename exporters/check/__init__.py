"""What is wrong with an asset, in words: everything that can be told from the file alone."""

from exporters.check.asset import check_glb, check_gltf
from exporters.check.compiler import Compiler, gl_compiler, isolated_compiler
from exporters.check.finding import Finding, Severity

__all__ = ["Compiler", "Finding", "Severity", "check_glb", "check_gltf", "gl_compiler", "isolated_compiler"]
