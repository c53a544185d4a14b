"""Where an asset comes from, kept from format to format."""

from collections.abc import Mapping
from importlib.metadata import PackageNotFoundError, version
from typing import Any

from core.errors import AssetInvalid
from exporters.gltf import Provenance
from exporters.gltf.document import Document
from exporters.gltf.provenance import CREATOR_TOOL, provenance_of


def of_conversion(title: str, source: str, settings: Mapping[str, str | int | float]) -> Provenance:
    """What a conversion knows. No date: the same conversion gives the same file."""
    return Provenance(title=title, source=source, version=_version(), settings=settings)


def in_glb(data: bytes) -> Provenance | None:
    """What a .glb says of itself; None where it says nothing, or nothing that Polyfield has written."""
    try:
        packet = provenance_of(Document.of_glb(data).json)
        return _of_packet(packet) if packet else None
    except (AssetInvalid, KeyError, IndexError, TypeError, AttributeError):
        return None


def _of_packet(packet: Mapping[str, Any]) -> Provenance:
    """The reverse of exporters.gltf.provenance.packet."""
    (creator,) = packet["dc:creator"]["@list"] if "dc:creator" in packet else ("",)
    return Provenance(
        title=_in_any_language(packet, "dc:title"),
        source=packet.get("dc:source", ""),
        creator=creator,
        rights=_in_any_language(packet, "dc:rights"),
        created=packet.get("xmp:CreateDate", ""),
        version=packet.get("xmp:CreatorTool", "").removeprefix(CREATOR_TOOL).strip(),
        settings=packet.get("polyfield:settings", {}),
    )


def _in_any_language(packet: Mapping[str, Any], name: str) -> str:
    return packet[name]["rdf:_1"]["@value"] if name in packet else ""


def _version() -> str:
    try:
        return version("polyfield")
    except PackageNotFoundError:  # run from its sources
        return ""
