"""A plain mesh for tools that know nothing else: OBJ with textures, PLY with colours at its vertices.

Both hold the fallback, the mean colours, upright in the asset's frame (+y up, the capture's scale where it has one).
"""

from exporters.plain.obj import write_obj
from exporters.plain.ply import write_ply

__all__ = ["write_obj", "write_ply"]
