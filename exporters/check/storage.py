"""Is the content of a page stored as loaders expect it: aligned, and as the kind of image that the file says?"""

from typing import Any

from exporters.check.finding import Findings
from exporters.gltf.document import WEBP, Document
from exporters.webp import is_webp

_COMPONENT_BYTES = {5120: 1, 5121: 1, 5122: 2, 5123: 2, 5125: 4, 5126: 4}
_ATTRIBUTE_ALIGNMENT = 4


def check_alignment(found: Findings, document: Document, primitive: dict[str, Any], name: str) -> None:
    """Adds a finding for accessors that a typed array cannot be laid over (glTF 2.0, section 3.6.2.4).

    Raises:
        AssetInvalid; KeyError, TypeError, ValueError for JSON of another structure.
    """
    accessors = {**{kind: (index, _ATTRIBUTE_ALIGNMENT) for kind, index in primitive["attributes"].items()}}
    accessors["indices"] = (primitive["indices"], 1)
    for kind, (index, least) in accessors.items():
        accessor = document.item("accessors", index)
        view = document.item("bufferViews", accessor.get("bufferView"))
        component: Any = accessor.get("componentType")
        alignment = max(least, _COMPONENT_BYTES.get(component, 1))
        offset = accessor.get("byteOffset", 0)
        for start in (offset, offset + view.get("byteOffset", 0)):
            if start % alignment:
                found.error(
                    "mesh", f"{name}, {kind}", f"must start at a multiple of {alignment} bytes, but starts at {start}"
                )
                break


def check_image_kind(found: Findings, document: Document, texture: int, data: bytes, subject: str) -> None:
    """Adds a finding where a texture's file is not of the kind that the JSON says.

    Raises:
        AssetInvalid; KeyError, TypeError, ValueError for JSON of another structure.
    """
    content = document.item("textures", texture)
    coded = content.get("extensions", {}).get(WEBP)
    image = document.item("images", (coded or content).get("source"))
    kind = "image/webp" if is_webp(data) else "image/png"
    stated = image.get("mimeType")
    if (stated is None and "bufferView" in image) or stated not in (None, kind):
        found.error("texture", subject, f"must state its mimeType, {kind}, but states {str(stated)[:40]}")
    if (kind == "image/webp") != (coded is not None):
        found.error("texture", subject, f"must be named by {WEBP} if it is WebP, and only then, but is {kind}")
