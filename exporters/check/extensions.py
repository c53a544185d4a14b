"""Are the extensions in use listed as glTF and the loaders want them?"""

from typing import Any

from exporters.check.finding import Findings
from exporters.gltf import extension
from exporters.gltf.document import SHORT, WEBP, Document
from exporters.gltf.meshopt_codec import MESHOPT

QUANTIZATION = "KHR_mesh_quantization"
GENERAL = (extension.NAME, "KHR_materials_unlit")
MAY_BE_REQUIRED = (MESHOPT, WEBP, QUANTIZATION)


def check_extensions(found: Findings, document: Document) -> None:
    """Adds what is wrong with `extensionsUsed` and `extensionsRequired`.

    Raises:
        KeyError, TypeError, ValueError for JSON of another structure.
    """
    used, required = (_names(document, f"extensions{kind}") for kind in ("Used", "Required"))
    for name in GENERAL:
        if name not in used:
            found.error("extension", "extensionsUsed", f"must list {name}")
        if name in required:
            found.error("extension", "extensionsRequired", f"must not list {name}: other viewers would refuse the file")
    for name in _codings(document):
        if name not in used or name not in required:
            found.error("extension", "extensionsRequired", f"must list {name}, and extensionsUsed, too: it is in use")
    for name in required:
        if name not in used:
            found.error("extension", "extensionsUsed", f"must list {name}, which extensionsRequired lists")
        if name not in (*MAY_BE_REQUIRED, *GENERAL):
            found.warning("extension", "extensionsRequired", f"should not list {name}: no reader of this file needs it")


def _names(document: Document, kind: str) -> list[str]:
    return [str(name)[:80] for name in document.json.get(kind, [])]


def _codings(document: Document) -> list[str]:
    """What a loader has to know to find its way to the content."""
    json = document.json
    views, textures = (list(json.get(kind, [])) for kind in ("bufferViews", "textures"))
    codings = []
    if any(MESHOPT in _extensions(view) for view in views):
        codings.append(MESHOPT)
    if any(WEBP in _extensions(texture) and "source" not in texture for texture in textures):
        codings.append(WEBP)
    positions = {
        primitive.get("attributes", {}).get("POSITION")
        for mesh in json.get("meshes", [])
        for primitive in mesh["primitives"]
    }
    if any(document.item("accessors", index).get("componentType") == SHORT for index in positions - {None}):
        codings.append(QUANTIZATION)
    return codings


def _extensions(item: Any) -> dict[str, Any]:
    extensions: dict[str, Any] = item.get("extensions", {})
    return extensions
