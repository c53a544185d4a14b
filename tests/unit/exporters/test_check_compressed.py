"""The check of files for the web and for phones."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from core.baked import BakedScene
from exporters.check import Finding, check_glb
from exporters.gltf import write_lq_glb, write_web_glb
from exporters.gltf.extension import NAME
from tests.scenes import random_scene, tiny_scene
from tests.unit.exporters.glb import join, split
from tests.unit.exporters.test_check import accepts_all, gentle, in_json, trained_like
from tests.unit.exporters.test_compressed_damage import coding

Json = dict[str, Any]
GOOD = write_web_glb(trained_like(tiny_scene()))["scene.web.glb"]
SMALL = write_web_glb(random_scene(np.random.default_rng(5), 4))["scene.web.glb"]


def required(document: Json) -> list[str]:
    return document["extensionsRequired"]


def webp_texture(document: Json) -> Json:
    return next(texture for texture in document["textures"] if "extensions" in texture)


def cut_off(document: Json) -> None:
    coding(document, 0)["byteLength"] -= 8


def as_png(document: Json) -> None:
    """A WebP image named as if it were a PNG."""
    texture = webp_texture(document)
    texture["source"] = texture.pop("extensions")["EXT_texture_webp"]["source"]


FAULTS: dict[str, tuple[Callable[[bytes], bytes], str, str]] = {
    "codec not required": (in_json(lambda d: required(d).remove("EXT_meshopt_compression")), "extension", "mesho"),
    "quantisation not required": (in_json(lambda d: required(d).remove("KHR_mesh_quantization")), "extension", "quant"),
    "WebP not required": (in_json(lambda d: required(d).remove("EXT_texture_webp")), "extension", "webp"),
    "required but not used": (in_json(lambda d: d["extensionsUsed"].remove("EXT_texture_webp")), "extension", "webp"),
    "WebP named as PNG": (in_json(as_png), "texture", "EXT_texture_webp"),
    "compressed vertices cut off": (in_json(cut_off), "mesh", "intact"),
    "a gigabyte of vertices": (in_json(lambda d: coding(d, 0).update(count=1 << 27)), "mesh", "must not decode"),
    "compressed elsewhere": (in_json(lambda d: coding(d, 0).update(buffer=1)), "mesh", "buffer 0"),
    "another filter": (in_json(lambda d: coding(d, 1).update(filter="OCTAHEDRAL")), "mesh", "filtered"),
    "bounds wrong": (in_json(lambda d: d["accessors"][0].update(max=[9, 9, 9])), "mesh", "max"),
    "textures exchanged": (
        in_json(lambda d: d["meshes"][0]["primitives"][0]["extensions"][NAME]["featureTextures"].reverse()),
        "feature", "exchanged",
    ),
}  # fmt: skip


@pytest.mark.parametrize("write", [write_web_glb, write_lq_glb])
def test_good_asset_has_no_findings(write: Callable[[BakedScene], dict[str, bytes]]) -> None:
    (glb,) = write(gentle(tiny_scene())).values()
    assert check_glb(glb, accepts_all) == []


@pytest.mark.parametrize(("damage", "code", "words"), FAULTS.values(), ids=FAULTS.keys())
def test_fault_is_named(damage: Callable[[bytes], bytes], code: str, words: str) -> None:
    findings = check_glb(damage(GOOD), accepts_all)
    assert any(finding.code == code and words in str(finding) for finding in findings), findings
    assert len(findings) <= 4, findings


@settings(max_examples=100, deadline=None)
@given(data=st.data())
def test_flipped_bytes_are_judged(data: st.DataObject) -> None:
    document, binary = split(SMALL)
    damaged = bytearray(join(document, binary))
    for _ in range(data.draw(st.integers(1, 4))):
        damaged[data.draw(st.integers(len(SMALL) - len(binary), len(SMALL) - 1))] = data.draw(st.integers(0, 255))
    assert all(isinstance(finding, Finding) for finding in check_glb(bytes(damaged), accepts_all))
