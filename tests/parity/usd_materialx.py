"""GLSL that MaterialX's own generator makes of a USD material's MaterialX output."""

from functools import cache
from typing import Any

import MaterialX
from MaterialX import PyMaterialXGenGlsl, PyMaterialXGenShader
from pxr import Gf, Sdf, UsdShade


@cache
def standard_library() -> MaterialX.Document:
    library = MaterialX.createDocument()
    MaterialX.loadLibraries(MaterialX.getDefaultDataLibraryFolders(), MaterialX.getDefaultDataSearchPath(), library)
    return library


def document_of(material: UsdShade.Material) -> tuple[MaterialX.Document, MaterialX.Node]:
    """A valid MaterialX document of the `mtlx` surface, and its surface node. Nodes are those that Sdr would find."""
    document = MaterialX.createDocument()
    document.setDataLibrary(standard_library())
    surface = material.ComputeSurfaceSource("mtlx")[0]
    graphs = {source.GetPath(): source for source in _graphs(surface)}
    for graph in graphs.values():
        _add_graph(document, UsdShade.NodeGraph(graph))
    node = _add_node(document, surface)
    valid, fault = document.validate()
    assert valid, fault
    return document, node


def generated_glsl(material: UsdShade.Material) -> tuple[str, str]:
    """Vertex and fragment shader of a material, constants inlined, lit by an environment."""
    document, surface = document_of(material)
    generator = PyMaterialXGenGlsl.GlslShaderGenerator.create()
    context = PyMaterialXGenShader.GenContext(generator)
    context.registerSourceCodeSearchPath(MaterialX.getDefaultDataSearchPath())
    options = context.getOptions()
    options.hwTransparency = True
    options.hwMaxActiveLightSources = 0
    options.hwSpecularEnvironmentMethod = PyMaterialXGenShader.HwSpecularEnvironmentMethod.SPECULAR_ENVIRONMENT_FIS
    options.shaderInterfaceType = PyMaterialXGenShader.ShaderInterfaceType.SHADER_INTERFACE_REDUCED
    shader = generator.generate("material", surface, context)
    assert document  # must outlive its nodes
    return shader.getSourceCode("vertex"), shader.getSourceCode("pixel")


def _graphs(surface: UsdShade.Shader) -> list[Any]:
    sources = [_source(item) for item in surface.GetInputs() if item.HasConnectedSource()]
    return [source.source.GetPrim() for source in sources if source.source.GetPrim().IsA(UsdShade.NodeGraph)]


def _add_graph(document: MaterialX.Document, graph: UsdShade.NodeGraph) -> None:
    target = document.addNodeGraph(graph.GetPrim().GetName())
    for prim in graph.GetPrim().GetChildren():
        _add_node(target, UsdShade.Shader(prim))
    for output in graph.GetOutputs():
        name = _source(output).source.GetPrim().GetName()
        target.addOutput(output.GetBaseName(), target.getNode(name).getType()).setNodeName(name)


def _add_node(parent: Any, shader: UsdShade.Shader) -> MaterialX.Node:
    definition = standard_library().getNodeDef(shader.GetIdAttr().Get())
    assert definition, shader.GetIdAttr().Get()
    node = parent.addNode(definition.getNodeString(), shader.GetPrim().GetName(), definition.getType())
    node.setNodeDefString(definition.getName())
    for item in shader.GetInputs():
        declared = definition.getActiveInput(item.GetBaseName())
        assert declared, f"{definition.getName()} has no input {item.GetBaseName()}"
        target = node.addInput(item.GetBaseName(), declared.getType())
        if not item.HasConnectedSource():
            target.setValueString(_text(item.Get()))
        elif (source := _source(item)).source.GetPrim().IsA(UsdShade.NodeGraph):
            target.setNodeGraphString(source.source.GetPrim().GetName())
            target.setOutputString(source.sourceName)
        else:
            target.setNodeName(source.source.GetPrim().GetName())
    return node


def _source(item: Any) -> Any:
    return item.GetConnectedSources()[0][0]


def _text(value: Any) -> str:
    """As USD's own bridge to MaterialX writes values."""
    if isinstance(value, Sdf.AssetPath):
        return value.path
    if isinstance(value, Gf.Matrix4d):
        return ", ".join(repr(number) for row in value for number in row)
    if isinstance(value, str | int | float):
        return str(value)
    return ", ".join(repr(float(number)) for number in value)
