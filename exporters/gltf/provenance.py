"""Where an asset comes from, as XMP (KHR_xmp_json_ld): what asset managers show and search."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import pygltflib as gltf

NAME = "KHR_xmp_json_ld"
# Names of vocabularies, not addresses to be fetched.
CONTEXT = {
    "dc": "http://purl.org/dc/elements/1.1/",
    "xmp": "http://ns.adobe.com/xap/1.0/",
    "rdf": "http://www.w3.org/1999/02/22-rdf-syntax-ns#",
    "polyfield": "urn:polyfield:",
}
CREATOR_TOOL = "Polyfield"
FORMAT = "model/gltf-binary"


@dataclass(frozen=True)
class Provenance:
    """What is known; empty fields are left out.

    Attributes:
        title: of the asset.
        source: the capture it was made from, by its name.
        creator: who took the photos.
        rights: who may do what with it.
        created: when it was converted, ISO 8601.
        version: of Polyfield.
        settings: what repeats the conversion, by name.
    """

    title: str = ""
    source: str = ""
    creator: str = ""
    rights: str = ""
    created: str = ""
    version: str = ""
    settings: Mapping[str, str | int | float | bool | None] = field(default_factory=dict)


def add_provenance(document: gltf.GLTF2, provenance: Provenance) -> None:
    """Adds the packet, and refers to it from the asset."""
    document.extensionsUsed = [*document.extensionsUsed, NAME]
    document.extensions[NAME] = {"packets": [packet(provenance)]}
    document.asset.extensions = {NAME: {"packet": 0}}


def packet(provenance: Provenance) -> dict[str, Any]:
    """One XMP packet in JSON-LD, with the containers that XMP prescribes: language alternatives, ordered lists."""
    stated = {
        "dc:title": _in_any_language(provenance.title),
        "dc:source": provenance.source,
        "dc:creator": {"@list": [provenance.creator]} if provenance.creator else None,
        "dc:rights": _in_any_language(provenance.rights),
        "xmp:CreateDate": provenance.created,
        "polyfield:settings": dict(provenance.settings),
    }
    tool = f"{CREATOR_TOOL} {provenance.version}".strip()
    return {
        "@context": CONTEXT,
        "@id": "",
        "dc:format": FORMAT,
        "xmp:CreatorTool": tool,
        **{name: value for name, value in stated.items() if value},
    }


def provenance_of(json: Mapping[str, Any]) -> Mapping[str, Any] | None:
    """The asset's packet in a glTF file's JSON; None where it has none."""
    reference = json.get("asset", {}).get("extensions", {}).get(NAME)
    packets = json.get("extensions", {}).get(NAME, {}).get("packets", [])
    return packets[reference["packet"]] if reference else None


def _in_any_language(text: str) -> dict[str, Any] | None:
    return {"@type": "rdf:Alt", "rdf:_1": {"@language": "x-default", "@value": text}} if text else None
