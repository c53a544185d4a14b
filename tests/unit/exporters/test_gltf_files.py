"""The .gltf with its files is the .glb taken apart."""

import json
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from core.baked import BakedScene
from core.errors import AssetInvalid
from exporters.gltf import read_glb, read_gltf, write_glb, write_gltf
from tests.scenes import random_scene
from tests.unit.exporters.equality import assert_equal
from tests.unit.exporters.glb import join, split

Files = dict[str, bytes]
SMALL: Files = write_gltf(random_scene(np.random.default_rng(5), 4))


def test_scene_comes_back_bit_for_bit(scene: BakedScene) -> None:
    assert_equal(read_gltf(write_gltf(scene)), scene)


def test_scene_in_a_folder_comes_back(scene: BakedScene) -> None:
    files = {f"out/lego/{name}": data for name, data in write_gltf(scene).items()}
    assert_equal(read_gltf(files), scene)


def test_files_are_named_by_what_they_hold(scene: BakedScene) -> None:
    textures = {f"page{n}.{label}.png" for n in range(2) for label in ("features0", "features1", "color")}
    assert set(write_gltf(scene)) == {"scene.gltf", "scene.bin"} | textures


def test_parts_are_those_of_the_glb(scene: BakedScene) -> None:
    files = write_gltf(scene)
    apart, (whole, binary) = json.loads(files["scene.gltf"]), split(write_glb(scene)["scene.glb"])
    for key in ("extensions", "nodes", "meshes", "materials", "textures", "cameras", "samplers", "scenes", "asset"):
        assert apart[key] == whole[key], key
    for image in whole["images"]:
        view = whole["bufferViews"][image["bufferView"]]
        start = view.get("byteOffset", 0)
        assert files[f"{image['name']}.png"] == binary[start : start + view["byteLength"]]


def test_writing_twice_gives_the_same_bytes(scene: BakedScene) -> None:
    assert write_gltf(scene) == write_gltf(scene)


def test_names_with_escapes_are_found(scene: BakedScene) -> None:
    files = write_gltf(scene)
    files["the buffer.bin"] = files.pop("scene.bin")
    files["scene.gltf"] = files["scene.gltf"].replace(b"scene.bin", b"the%20buffer.bin")
    assert_equal(read_gltf(files), scene)


def in_json(change: Callable[[dict[str, Any]], Any]) -> Callable[[Files], None]:
    def damage(files: Files) -> None:
        document = json.loads(files["scene.gltf"])
        change(document)
        files["scene.gltf"] = json.dumps(document).encode()

    return damage


DAMAGES: dict[str, Callable[[Files], Any]] = {
    "no gltf": lambda f: f.pop("scene.gltf"),
    "two gltfs": lambda f: f.update({"other.gltf": f["scene.gltf"]}),
    "no buffer": lambda f: f.pop("scene.bin"),
    "no texture": lambda f: f.pop("page0.features1.png"),
    "truncated buffer": lambda f: f.update({"scene.bin": f["scene.bin"][:-8]}),
    "not JSON": lambda f: f.update({"scene.gltf": b"glTF"}),
    "not UTF-8": lambda f: f.update({"scene.gltf": b'{"asset": "\xff"}'}),
    "image of the web": in_json(lambda d: d["images"][0].update(uri="https://example.com/x.png")),
    "image elsewhere": in_json(lambda d: d["images"][0].update(uri="../../etc/passwd")),
    "image as data": in_json(lambda d: d["images"][0].update(uri="data:image/png;base64,AAAA")),
    "image without uri": in_json(lambda d: d["images"][0].pop("uri")),
    "uri is a number": in_json(lambda d: d["images"][0].update(uri=5)),
    "buffer without uri": in_json(lambda d: d["buffers"][0].pop("uri")),
    "buffer is an image": in_json(lambda d: d["buffers"][0].update(uri="page0.color.png")),
}


@pytest.mark.parametrize("damage", DAMAGES.values(), ids=DAMAGES.keys())
def test_damaged_files_are_refused(damage: Callable[[Files], Any]) -> None:
    files = dict(SMALL)
    damage(files)
    with pytest.raises(AssetInvalid) as caught:
        read_gltf(files)
    assert caught.value.remedy


def test_glb_may_not_name_other_files(scene: BakedScene) -> None:
    document, binary = split(write_glb(scene)["scene.glb"])
    document["images"][0] = {"uri": "page0.features0.png", "mimeType": "image/png"}
    with pytest.raises(AssetInvalid, match="within"):
        read_glb(join(document, binary))


@settings(max_examples=100, deadline=None)
@given(data=st.data())
def test_flipped_bytes_give_a_scene_or_asset_invalid(data: st.DataObject) -> None:
    name = data.draw(st.sampled_from(sorted(SMALL)))
    damaged = bytearray(SMALL[name])
    for _ in range(data.draw(st.integers(1, 4))):
        damaged[data.draw(st.integers(0, len(damaged) - 1))] = data.draw(st.integers(0, 255))
    try:
        scene = read_gltf(SMALL | {name: bytes(damaged)})
    except AssetInvalid:
        return
    assert isinstance(scene, BakedScene)
