"""Whatever the bytes are, the reader returns a scene or raises AssetInvalid."""

import copy
import json
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from core.baked import BakedScene
from core.errors import AssetInvalid
from exporters.gltf import read_glb, read_shaders, write_glb
from exporters.gltf.extension import NAME
from exporters.png import encode_png
from tests.scenes import random_scene
from tests.unit.exporters.glb import join, split

Json = dict[str, Any]
SMALL = write_glb(random_scene(np.random.default_rng(5), 4))["scene.glb"]
JSON_VALUES = st.sampled_from([None, True, -1, 0, 1, 7, 2**31, 10**30, 0.5, 1e300, "", "x", [], [0], {}, {"a": 1}])


def network(document: Json) -> Json:
    return document["extensions"][NAME]["networks"][0]


def set_weight(value: Any) -> Callable[[Json], None]:
    def change(document: Json) -> None:
        network(document)["layers"][1]["weights"][2][3] = value

    return change


def neural(document: Json) -> Json:
    return document["meshes"][0]["primitives"][0]["extensions"][NAME]


DAMAGES: dict[str, Callable[[Json], Any]] = {
    "NaN weight": set_weight(float("nan")),
    "infinite weight": set_weight(float("inf")),
    "weight beyond float32": set_weight(1e39),
    "weight beyond float64": set_weight(10**400),
    "weight as text": set_weight("1.0"),
    "weight missing": lambda d: network(d)["layers"][0]["weights"][0].pop(),
    "layer missing": lambda d: network(d)["layers"].pop(),
    "another activation": lambda d: network(d)["layers"][0].update(activation="tanh"),
    "two networks": lambda d: d["extensions"][NAME]["networks"].append(network(d)),
    "no networks": lambda d: d["extensions"][NAME].pop("networks"),
    "no extension": lambda d: d.pop("extensions"),
    "extension as list": lambda d: d.update(extensions=[]),
    "no neural primitive": lambda d: d["meshes"][0]["primitives"][0].pop("extensions"),
    "another coding": lambda d: neural(d).update(coding="float16"),
    "texture out of range": lambda d: neural(d)["featureTextures"][0].update(index=99),
    "negative texture": lambda d: neural(d)["featureTextures"][0].update(index=-1),
    "one feature texture": lambda d: neural(d)["featureTextures"].pop(),
    "image without buffer view": lambda d: d["images"][0].pop("bufferView"),
    "buffer view beyond the file": lambda d: d["bufferViews"][0].update(byteLength=10**9),
    "negative offset": lambda d: d["bufferViews"][0].update(byteOffset=-4),
    "external buffer": lambda d: d["buffers"][0].update(uri="http://example.com/x.bin"),
    "accessor out of range": lambda d: d["meshes"][0]["primitives"][0].update(indices=77),
    "accessor too long": lambda d: d["accessors"][0].update(count=10**6),
    "accessor of another type": lambda d: d["accessors"][0].update(componentType=5123),
    "sparse accessor": lambda d: d["accessors"][0].update(sparse={"count": 1}),
    "triangle strip": lambda d: d["meshes"][0]["primitives"][0].update(mode=5),
    "no positions": lambda d: d["meshes"][0]["primitives"][0]["attributes"].pop("POSITION"),
    "zero triangles": lambda d: d["accessors"][2].update(count=0),
    "indices not in threes": lambda d: d["accessors"][2].update(count=4),
    "no scene": lambda d: d.update(scenes=[]),
    "two roots": lambda d: d["scenes"][0].update(nodes=[0, 0]),
    "NaN in the transform": lambda d: d["nodes"][0].update(matrix=[float("nan")] * 16),
    "background out of range": lambda d: d["extensions"][NAME].update(background=[2, 0, 0]),
    "pose not rigid": lambda d: d["extensions"][NAME]["views"][0].update(objectFromCamera=[2.0] * 16),
    "image size zero": lambda d: d["extensions"][NAME]["views"][0].update(imageSize=[0, 4]),
    "view's node out of range": lambda d: d["extensions"][NAME]["views"][0].update(node=50),
}


@pytest.mark.parametrize("damage", DAMAGES.values(), ids=DAMAGES.keys())
def test_damaged_json_is_refused(damage: Callable[[Json], Any]) -> None:
    document, binary = split(SMALL)
    damage(document)
    with pytest.raises(AssetInvalid) as caught:
        read_glb(join(document, binary))
    assert caught.value.remedy


def test_undamaged_file_survives_being_taken_apart() -> None:
    assert read_glb(join(*split(SMALL))).quad_count == 4


@pytest.mark.parametrize(
    "data", [b"", b"glTF", b"PK\x03\x04", b"x" * 100, SMALL[:12], SMALL[:-1], SMALL + b"\0", SMALL[:20]]
)
def test_other_and_truncated_files_are_refused(data: bytes) -> None:
    with pytest.raises(AssetInvalid):
        read_glb(data)


def test_stock_gltf_without_the_extension_is_refused() -> None:
    with pytest.raises(AssetInvalid, match=NAME):
        read_glb(join({"asset": {"version": "2.0"}}, b""))


def test_deeply_nested_json_is_refused() -> None:
    text = b"[" * 100_000
    document, binary = split(SMALL)
    glb = join(document, binary).replace(json.dumps(document).encode(), text)
    with pytest.raises(AssetInvalid):
        read_glb(glb[:8] + len(glb).to_bytes(4, "little") + len(text).to_bytes(4, "little") + glb[16:])


def test_index_beyond_the_vertices_is_refused() -> None:
    document, binary = split(SMALL)
    view = document["bufferViews"][document["accessors"][2]["bufferView"]]
    start = view["byteOffset"]
    with pytest.raises(AssetInvalid, match="triangles"):
        read_glb(join(document, binary[:start] + b"\xff\x00" + binary[start + 2 :]))


@pytest.mark.parametrize("image", range(3))
def test_texture_of_another_size_is_refused(image: int) -> None:
    with pytest.raises(AssetInvalid, match="one size"):
        read_glb(_with_image(image, np.zeros((8, 8, 4), np.uint8)))


def test_fallback_with_other_holes_is_refused() -> None:
    size = _page_size()
    with pytest.raises(AssetInvalid, match="holes"):
        read_glb(_with_image(2, np.zeros((*size, 4), np.uint8)))


def test_many_pages_on_one_small_image_are_refused() -> None:
    document, binary = split(SMALL)
    document["meshes"] *= 300
    with pytest.raises(AssetInvalid, match="256"):
        read_glb(join(document, binary))


def test_external_image_is_refused() -> None:
    document, binary = split(SMALL)
    document["images"][0] = {"uri": "http://example.com/x.png"}
    with pytest.raises(AssetInvalid):
        read_glb(join(document, binary))


@settings(max_examples=150, deadline=None)
@given(length=st.integers(0, len(SMALL)))
def test_truncation_anywhere_is_refused(length: int) -> None:
    if length < len(SMALL):
        with pytest.raises(AssetInvalid):
            read_glb(SMALL[:length])


@settings(max_examples=300, deadline=None)
@given(data=st.data())
def test_flipped_bytes_give_a_scene_or_asset_invalid(data: st.DataObject) -> None:
    damaged = bytearray(SMALL)
    for _ in range(data.draw(st.integers(1, 4))):
        damaged[data.draw(st.integers(0, len(SMALL) - 1))] = data.draw(st.integers(0, 255))
    _read_or_refuse(bytes(damaged))


@settings(max_examples=300, deadline=None, suppress_health_check=[HealthCheck.data_too_large])
@given(data=st.data())
def test_any_json_value_anywhere_gives_a_scene_or_asset_invalid(data: st.DataObject) -> None:
    document, binary = split(SMALL)
    for shader in ("essl300", "glsl330"):
        network(document)["shaders"].pop(shader)
    node: Any = copy.deepcopy(document)
    root = node
    while True:  # walks down to a random place
        key = data.draw(st.sampled_from(sorted(node) if isinstance(node, dict) else range(len(node))))
        child = node[key]
        if not isinstance(child, dict | list) or not child or data.draw(st.integers(0, 3)) == 0:
            break
        node = child
    node[key] = data.draw(JSON_VALUES)
    _read_or_refuse(join(root, binary))


@settings(max_examples=100, deadline=None)
@given(st.binary(max_size=200))
def test_any_bytes_are_refused(data: bytes) -> None:
    with pytest.raises(AssetInvalid):
        read_glb(data)


def _read_or_refuse(glb: bytes) -> None:
    for read in (read_glb, read_shaders):
        try:
            result = read(glb)
        except AssetInvalid:
            continue
        assert isinstance(result, BakedScene | dict)


def _page_size() -> tuple[int, int]:
    return read_glb(SMALL).pages[0].features_u8.shape[:2]


def _with_image(index: int, image: np.ndarray) -> bytes:
    """SMALL with another image, appended to the binary chunk."""
    document, binary = split(SMALL)
    png = encode_png(image)
    document["bufferViews"][document["images"][index]["bufferView"]].update(byteOffset=len(binary), byteLength=len(png))
    return join(document, binary + png)
