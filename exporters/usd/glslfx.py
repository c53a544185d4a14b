"""The network as a surface shader for Storm, OpenUSD's rasteriser.

Storm takes glslfx: GLSL with a preamble, in a dialect of accessors that it generates (`HdGet_...` of the material's
inputs, textures and primvars). What is used here is what OpenUSD's own shaders and tests use. Storm's pictures are
linear, and are encoded for the screen at the end.
"""

import json
from importlib import resources
from string import Template

from core.baked import ShaderNetwork
from exporters.glsl.network import network_function

# Inputs of the shader. Storm gives a connected texture the type of the output that it is connected to, and
# UsdUVTexture has no output of all four channels.
COLORS = ("features0", "features1")
ALPHAS = ("feature3", "feature7")
PAGE_SIZE = "pageSize"

_CONFIGURATION = {
    "metadata": {"materialTag": "masked"},
    "parameters": {PAGE_SIZE: {"default": [1.0, 1.0]}},
    "textures": {name: {} for name in (*COLORS, *ALPHAS)},
    "attributes": {"st": {"type": "vec2"}},
    "techniques": {"default": {"surfaceShader": {"source": ["Polyfield.Surface"]}}},
}


def glslfx_source(network: ShaderNetwork) -> str:
    """The whole text, for `info:glslfx:sourceCode`."""
    template = resources.files("exporters.usd").joinpath("templates", "surface.glslfx.glsl").read_text(encoding="utf-8")
    configuration = json.dumps(_CONFIGURATION, indent=4)
    return Template(template).substitute(configuration=configuration, network=network_function(network))
