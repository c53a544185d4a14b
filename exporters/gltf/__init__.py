"""glTF files of baked scenes, with the vendor extension POLYFIELD_materials_neural."""

from exporters.gltf.provenance import Provenance
from exporters.gltf.reader import read_glb, read_gltf, read_shaders
from exporters.gltf.writer import write_glb, write_gltf, write_lq_glb, write_web_glb

__all__ = [
    "Provenance",
    "read_glb",
    "read_gltf",
    "read_shaders",
    "write_glb",
    "write_gltf",
    "write_lq_glb",
    "write_web_glb",
]
