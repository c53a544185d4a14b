"""glTF files of baked scenes, with the vendor extension POLYFIELD_materials_neural."""

from exporters.gltf.reader import read_glb, read_gltf, read_shaders
from exporters.gltf.writer import write_glb, write_gltf

__all__ = ["read_glb", "read_gltf", "read_shaders", "write_glb", "write_gltf"]
