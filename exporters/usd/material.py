"""The materials: one class that holds all of the look, and one material per page that names its textures.

A material has three outputs. Renderers take the first one that they know:

glslfx:surface   Storm: the network as glslfx.
mtlx:surface     renderers with MaterialX: the network as a graph of standard nodes.
surface          all others: UsdPreviewSurface, which only emits the mean colours, so that no light changes them.
"""

from typing import Any

import numpy as np
from pxr import Gf, Sdf, Usd, UsdShade, Vt

from core.baked import ShaderNetwork
from exporters.usd import glslfx, schema
from exporters.usd.materialx_graph import FEATURE_IMAGES, PAGE_SIZE, Graph, Node, network_graph
from exporters.usd.matrices import to_usd

CLASS_NAME = "neural"
GRAPH_NAME = "network"
COLOR_TEXTURE = "color"
ALPHA_THRESHOLD = 0.5
MATERIALX_VERSION = "1.38"  # the oldest that the graph's nodes are in

_TYPES = {
    "float": Sdf.ValueTypeNames.Float,
    "integer": Sdf.ValueTypeNames.Int,
    "string": Sdf.ValueTypeNames.String,
    "filename": Sdf.ValueTypeNames.Asset,
    "vector2": Sdf.ValueTypeNames.Float2,
    "vector3": Sdf.ValueTypeNames.Float3,
    "vector4": Sdf.ValueTypeNames.Float4,
    "color3": Sdf.ValueTypeNames.Color3f,
    "matrix44": Sdf.ValueTypeNames.Matrix4d,
    "surfaceshader": Sdf.ValueTypeNames.Token,
}


def add_material_class(scope: Usd.Prim, network: ShaderNetwork) -> Usd.Prim:
    """The class below `scope` that pages' materials inherit: everything but textures and their size."""
    stage = scope.GetStage()
    prim = stage.CreateClassPrim(scope.GetPath().AppendChild(CLASS_NAME))
    prim.SetTypeName("Material")
    material = UsdShade.Material(prim)
    _write_network(prim, network)
    coordinates = _shader(material, "st", "UsdPrimvarReader_float2")
    coordinates.CreateInput("varname", Sdf.ValueTypeNames.String).Set("st")
    st = coordinates.CreateOutput("result", Sdf.ValueTypeNames.Float2)
    material.CreateSurfaceOutput().ConnectToSource(_preview(material, st))
    material.CreateSurfaceOutput("glslfx").ConnectToSource(_storm(material, st, network))
    material.CreateSurfaceOutput("mtlx").ConnectToSource(_materialx(material, network_graph(network)))
    return prim


def add_page_material(scope: Usd.Prim, name: str, files: dict[str, str], size: tuple[int, int]) -> UsdShade.Material:
    """The material of one page.

    Args:
        files: asset paths by texture: "features0", "features1", "color".
        size: (height, width), texels.
    """
    stage = scope.GetStage()
    material = UsdShade.Material.Define(stage, scope.GetPath().AppendChild(name))
    material.GetPrim().GetInherits().AddInherit(scope.GetPath().AppendChild(CLASS_NAME))
    for texture, file in files.items():
        over = stage.OverridePrim(material.GetPath().AppendChild(texture))
        over.CreateAttribute("inputs:file", Sdf.ValueTypeNames.Asset).Set(Sdf.AssetPath(file))
    graph = material.GetPath().AppendChild(GRAPH_NAME)
    for image in FEATURE_IMAGES:
        over = stage.OverridePrim(graph.AppendChild(image))
        attribute = over.CreateAttribute("inputs:file", Sdf.ValueTypeNames.Asset)
        attribute.Set(Sdf.AssetPath(files[image]))
        attribute.SetColorSpace("raw")
    height, width = size
    for path, name in ((graph.AppendChild(PAGE_SIZE), "value"), (material.GetPath().AppendChild("storm"), PAGE_SIZE)):
        over = stage.OverridePrim(path)
        over.CreateAttribute(f"inputs:{name}", Sdf.ValueTypeNames.Float2).Set(Gf.Vec2f(width, height))
    return material


def add_preview_material(path: Sdf.Path, stage: Usd.Stage, file: str) -> UsdShade.Material:
    """A material that is the fallback alone."""
    material = UsdShade.Material.Define(stage, path)
    coordinates = _shader(material, "st", "UsdPrimvarReader_float2")
    coordinates.CreateInput("varname", Sdf.ValueTypeNames.String).Set("st")
    st = coordinates.CreateOutput("result", Sdf.ValueTypeNames.Float2)
    material.CreateSurfaceOutput().ConnectToSource(_preview(material, st, file))
    return material


def _write_network(prim: Usd.Prim, network: ShaderNetwork) -> None:
    """The weights as numbers: they are what the graph and the shader are made from."""
    prim.AddAppliedSchema(schema.NETWORK_API)
    numbers = zip((*schema.WEIGHTS, *schema.BIASES), (*network.weights, *network.biases), strict=True)
    for name, values in numbers:
        attribute = prim.CreateAttribute(name, Sdf.ValueTypeNames.FloatArray, False, Sdf.VariabilityUniform)
        attribute.Set(Vt.FloatArray.FromNumpy(np.ascontiguousarray(values, np.float32).ravel()))
    activations = prim.CreateAttribute(schema.ACTIVATIONS, Sdf.ValueTypeNames.TokenArray, False, Sdf.VariabilityUniform)
    activations.Set(Vt.TokenArray(schema.RELU_RELU_SIGMOID))
    coding = prim.CreateAttribute(schema.CODING, Sdf.ValueTypeNames.Token, False, Sdf.VariabilityUniform)
    coding.Set(schema.UNORM8)


def _preview(material: UsdShade.Material, st: UsdShade.Output, file: str | None = None) -> UsdShade.Output:
    """Colours that are seen as they are: emitted by a black metal, which reflects nothing."""
    texture = _texture(material, COLOR_TEXTURE, st, "sRGB")
    if file is not None:
        texture.GetInput("file").Set(Sdf.AssetPath(file))
    surface = _shader(material, "preview", "UsdPreviewSurface")
    color, number = Sdf.ValueTypeNames.Color3f, Sdf.ValueTypeNames.Float
    surface.CreateInput("diffuseColor", color).Set(Gf.Vec3f(0.0))
    surface.CreateInput("metallic", number).Set(1.0)
    surface.CreateInput("roughness", number).Set(1.0)
    rgb = texture.CreateOutput("rgb", Sdf.ValueTypeNames.Float3)
    surface.CreateInput("emissiveColor", color).ConnectToSource(rgb)
    alpha = texture.CreateOutput("a", number)
    surface.CreateInput("opacity", number).ConnectToSource(alpha)
    surface.CreateInput("opacityThreshold", number).Set(ALPHA_THRESHOLD)
    return surface.CreateOutput("surface", Sdf.ValueTypeNames.Token)


def _storm(material: UsdShade.Material, st: UsdShade.Output, network: ShaderNetwork) -> UsdShade.Output:
    """The network in Storm's own language."""
    surface = UsdShade.Shader.Define(material.GetPrim().GetStage(), material.GetPath().AppendChild("storm"))
    surface.SetSourceCode(glslfx.glslfx_source(network), "glslfx")
    for image, color, alpha in zip(FEATURE_IMAGES, glslfx.COLORS, glslfx.ALPHAS, strict=True):
        texture = _texture(material, image, st, "raw")
        for name in ("minFilter", "magFilter"):  # Storm's own inputs
            texture.CreateInput(name, Sdf.ValueTypeNames.Token).Set("nearest")
        rgb = texture.CreateOutput("rgb", Sdf.ValueTypeNames.Float3)
        surface.CreateInput(color, Sdf.ValueTypeNames.Float3).ConnectToSource(rgb)
        a = texture.CreateOutput("a", Sdf.ValueTypeNames.Float)
        surface.CreateInput(alpha, Sdf.ValueTypeNames.Float).ConnectToSource(a)
    surface.CreateInput(glslfx.PAGE_SIZE, Sdf.ValueTypeNames.Float2).Set(Gf.Vec2f(1.0))
    return surface.CreateOutput("surface", Sdf.ValueTypeNames.Token)


def _materialx(material: UsdShade.Material, graph: Graph) -> UsdShade.Output:
    """The graph, and a surface that shows its colour as it is, with holes cut out."""
    prim = material.GetPrim()
    prim.AddAppliedSchema("MaterialXConfigAPI")
    prim.CreateAttribute("config:mtlx:version", Sdf.ValueTypeNames.String, False).Set(MATERIALX_VERSION)
    container = UsdShade.NodeGraph.Define(prim.GetStage(), material.GetPath().AppendChild(GRAPH_NAME))
    outputs = {node.name: _node(container, node) for node in graph.nodes}
    for name, node in (("outColor", graph.color), ("outAlpha", graph.alpha)):  # names that no node has
        container.CreateOutput(name, _TYPES[node.output]).ConnectToSource(outputs[node.name])
    surface = _shader(material, "materialx", "ND_gltf_pbr_surfaceshader")
    constants: dict[str, tuple[str, Any]] = {
        "base_color": ("color3", (0.0, 0.0, 0.0)),
        "metallic": ("float", 0.0),
        "specular": ("float", 0.0),  # no reflection at any angle
        "roughness": ("float", 1.0),
        "alpha_mode": ("integer", 1),  # masked
        "alpha_cutoff": ("float", ALPHA_THRESHOLD),
    }
    for name, (kind, value) in constants.items():
        surface.CreateInput(name, _TYPES[kind]).Set(_value(kind, value))
    surface.CreateInput("emissive", Sdf.ValueTypeNames.Color3f).ConnectToSource(container.GetOutput("outColor"))
    surface.CreateInput("alpha", Sdf.ValueTypeNames.Float).ConnectToSource(container.GetOutput("outAlpha"))
    return surface.CreateOutput("out", Sdf.ValueTypeNames.Token)


def _node(container: UsdShade.NodeGraph, node: Node) -> UsdShade.Output:
    """One node, connected to those before it."""
    shader = _shader(container, node.name, node.definition)
    for name, (kind, value) in node.inputs.items():
        attribute = shader.CreateInput(name, _TYPES[kind])
        if isinstance(value, Node):
            source = container.GetPath().AppendChild(value.name).AppendProperty("outputs:out")
            attribute.ConnectToSource(source)
        elif kind != "filename":
            attribute.Set(_value(kind, value))
    return shader.CreateOutput("out", _TYPES[node.output])


def _value(kind: str, value: Any) -> Any:
    if kind == "matrix44":
        return to_usd(value)
    if kind.startswith(("vector", "color")):
        return tuple(float(n) for n in value)
    return value


def _texture(material: UsdShade.Material, name: str, st: UsdShade.Output, color_space: str) -> UsdShade.Shader:
    texture = _shader(material, name, "UsdUVTexture")
    texture.CreateInput("file", Sdf.ValueTypeNames.Asset)
    texture.CreateInput("st", Sdf.ValueTypeNames.Float2).ConnectToSource(st)
    texture.CreateInput("sourceColorSpace", Sdf.ValueTypeNames.Token).Set(color_space)
    for name in ("wrapS", "wrapT"):
        texture.CreateInput(name, Sdf.ValueTypeNames.Token).Set("clamp")
    return texture


def _shader(parent: UsdShade.NodeGraph, name: str, identifier: str) -> UsdShade.Shader:
    shader = UsdShade.Shader.Define(parent.GetPrim().GetStage(), parent.GetPath().AppendChild(name))
    shader.CreateIdAttr(identifier)
    return shader
