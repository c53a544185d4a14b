"""Provenance is kept as XMP, and left out where nothing is known."""

import pytest

from core.baked import BakedScene
from exporters.gltf import Provenance, read_glb, write_glb, write_gltf, write_web_glb
from exporters.gltf.provenance import provenance_of
from tests.unit.exporters.glb import split

KNOWN = Provenance(
    title="Büste",
    source="museum.zip",
    creator="A. Photographer",
    rights="CC0",
    created="2030-01-02T03:04:05Z",
    version="1.2.3",
    settings={"preset": "draft", "seed": 0},
)


@pytest.mark.parametrize("write", [write_glb, write_web_glb])
def test_what_is_known_is_in_the_packet(scene: BakedScene, write) -> None:  # type: ignore[no-untyped-def]
    (glb,) = write(scene, KNOWN).values()
    packet = provenance_of(split(glb)[0])
    assert packet is not None
    assert packet["dc:title"] == {"@type": "rdf:Alt", "rdf:_1": {"@language": "x-default", "@value": "Büste"}}
    assert packet["dc:creator"] == {"@list": ["A. Photographer"]}
    assert (packet["dc:source"], packet["xmp:CreateDate"]) == ("museum.zip", "2030-01-02T03:04:05Z")
    assert packet["xmp:CreatorTool"] == "Polyfield 1.2.3"
    assert packet["polyfield:settings"] == {"preset": "draft", "seed": 0}
    assert all(name.split(":")[0] in packet["@context"] for name in packet if not name.startswith("@"))
    assert read_glb(glb).quad_count == scene.quad_count


def test_extension_is_used_but_never_required(scene: BakedScene) -> None:
    document, _ = split(write_glb(scene, KNOWN)["scene.glb"])
    assert "KHR_xmp_json_ld" in document["extensionsUsed"]
    assert "extensionsRequired" not in document


def test_unknown_fields_are_left_out(scene: BakedScene) -> None:
    packet = provenance_of(split(write_glb(scene, Provenance())["scene.glb"])[0])
    assert packet is not None
    assert set(packet) == {"@context", "@id", "dc:format", "xmp:CreatorTool"}


def test_without_provenance_there_is_no_packet(scene: BakedScene) -> None:
    document, _ = split(write_glb(scene)["scene.glb"])
    assert provenance_of(document) is None
    assert b"xmp" not in write_gltf(scene)["scene.gltf"]
