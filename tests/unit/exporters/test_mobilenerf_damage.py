"""Whatever the files are, the reader returns a scene or raises AssetInvalid."""

import json
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from core.baked import BakedScene
from core.errors import AssetInvalid
from exporters.mobilenerf import read_mobilenerf, write_mobilenerf
from exporters.png import encode_png
from tests.scenes import random_scene

Files = dict[str, bytes]
SMALL: Files = write_mobilenerf(random_scene(np.random.default_rng(5), 4))
JSON_VALUES = st.sampled_from([None, True, -1, 0, 1, 7, 10**30, 0.5, 1e300, "", "x", [], [0], [[1]], {}, {"a": 1}])


def replaced(name: str, old: bytes, new: bytes) -> Callable[[Files], None]:
    def change(files: Files) -> None:
        assert old in files[name]
        files[name] = files[name].replace(old, new, 1)

    return change


def appended(text: bytes) -> Callable[[Files], None]:
    return lambda files: files.update({"shape0.obj": files["shape0.obj"] + text})


def in_mlp(change: Callable[[dict[str, Any]], Any]) -> Callable[[Files], None]:
    def damage(files: Files) -> None:
        document = json.loads(files["mlp.json"])
        change(document)
        files["mlp.json"] = json.dumps(document).encode()

    return damage


def image(array: np.ndarray) -> Callable[[Files], None]:
    return lambda files: files.update({"shape0.pngfeat1.png": encode_png(array)})


DAMAGES: dict[str, Callable[[Files], Any]] = {
    "no mlp": lambda f: f.pop("mlp.json"),
    "two folders": lambda f: f.update({"other/mlp.json": f["mlp.json"]}),
    "no obj": lambda f: f.pop("shape0.obj"),
    "a part missing": lambda f: f.update({"shape0_0.obj": b"", "shape0_2.obj": f.pop("shape0.obj")}),
    "no second texture": lambda f: f.pop("shape0.pngfeat1.png"),
    "texture of another size": image(np.full((8, 8, 4), 255, np.uint8)),
    "truncated texture": lambda f: f.update({"shape0.pngfeat0.png": f["shape0.pngfeat0.png"][:200]}),
    "texture that is none": lambda f: f.update({"shape0.pngfeat0.png": b"GIF89a"}),
    "mlp is not JSON": replaced("mlp.json", b"{", b"["),
    "mlp is a list": lambda f: f.update({"mlp.json": b"[]"}),
    "mlp nested too deeply": lambda f: f.update({"mlp.json": b"[" * 100_000}),
    "no obj_num": in_mlp(lambda d: d.pop("obj_num")),
    "obj_num too large": in_mlp(lambda d: d.update(obj_num=10**9)),
    "obj_num is true": in_mlp(lambda d: d.update(obj_num=True)),
    "obj_num beyond the files": in_mlp(lambda d: d.update(obj_num=2)),
    "weights missing": in_mlp(lambda d: d.pop("1_weights")),
    "weights transposed": in_mlp(lambda d: d.update({"0_weights": np.zeros((16, 11)).tolist()})),
    "sixteen features": in_mlp(lambda d: d.update({"0_weights": np.zeros((19, 16)).tolist()})),
    "NaN weight": in_mlp(lambda d: d["2_bias"].__setitem__(0, float("nan"))),
    "weight as text": in_mlp(lambda d: d["2_bias"].__setitem__(0, "1.0")),
    "ragged weights": in_mlp(lambda d: d["0_weights"][3].pop()),
    "other axes": in_mlp(lambda d: d["polyfield"].update(axes="x-up")),
    "frame is flat": in_mlp(lambda d: d["polyfield"].update(objFromObject=[0.0] * 16)),
    "frame is text": in_mlp(lambda d: d["polyfield"].update(objFromObject="identity")),
    "start at no camera": in_mlp(lambda d: d["polyfield"].update(startView=5)),
    "background out of range": in_mlp(lambda d: d["polyfield"].update(background=[2, 0, 0])),
    "pose not rigid": in_mlp(lambda d: d["polyfield"]["views"][0].update(objectFromCamera=[2.0] * 16)),
    "two numbers in a vertex": appended(b"v 1 2\n"),
    "vertex of words": appended(b"v one two three\n"),
    "vertex NaN": appended(b"v nan 0 0\nvt 0 0\n"),
    "texture coordinate outside": appended(b"vt 2 0\nv 0 0 0\n"),
    "quad": appended(b"f 1/1 2/2 3/3 4/4\n"),
    "corner without texture": appended(b"f 1 2 3\n"),
    "index zero": appended(b"f 0/1 2/2 3/3\n"),
    "negative index": appended(b"f -1/-1 -2/-2 -3/-3\n"),
    "index beyond the vertices": appended(b"f 1/1 2/2 9999/9999\n"),
    "index beyond all numbers": appended(b"f 1/1 2/2 99999999999999999999/1\n"),
    "no faces": lambda f: f.update({"shape0.obj": f["shape0.obj"].partition(b"f ")[0]}),
    "empty obj": lambda f: f.update({"shape0.obj": b""}),
    "binary obj": lambda f: f.update({"shape0.obj": bytes(range(256))}),
}


@pytest.mark.parametrize("damage", DAMAGES.values(), ids=DAMAGES.keys())
def test_damaged_files_are_refused(damage: Callable[[Files], Any]) -> None:
    files = dict(SMALL)
    damage(files)
    with pytest.raises(AssetInvalid) as caught:
        read_mobilenerf(files)
    assert caught.value.remedy


def test_alpha_as_it_was_before_the_layout_is_refused(rng: np.random.Generator) -> None:
    files = dict(SMALL)
    size = read_mobilenerf(files).pages[0].features_u8.shape[:2]
    plain = rng.integers(1, 120, (*size, 4), dtype=np.uint8)
    files |= {f"shape0.pngfeat{half}.png": encode_png(plain) for half in range(2)}
    with pytest.raises(AssetInvalid, match="128"):
        read_mobilenerf(files)


def test_many_pages_on_one_small_image_are_refused() -> None:
    files = dict(SMALL)
    in_mlp(lambda d: d.update(obj_num=300))(files)
    with pytest.raises(AssetInvalid, match="256"):
        read_mobilenerf(files)


def test_no_files_are_refused() -> None:
    with pytest.raises(AssetInvalid, match=r"mlp\.json"):
        read_mobilenerf({})


@settings(max_examples=200, deadline=None)
@given(data=st.data())
def test_flipped_bytes_give_a_scene_or_asset_invalid(data: st.DataObject) -> None:
    name = data.draw(st.sampled_from(sorted(SMALL)))
    damaged = bytearray(SMALL[name])
    for _ in range(data.draw(st.integers(1, 4))):
        damaged[data.draw(st.integers(0, len(damaged) - 1))] = data.draw(st.integers(0, 255))
    _read_or_refuse(SMALL | {name: bytes(damaged)})


@settings(max_examples=150, deadline=None)
@given(data=st.data())
def test_any_json_value_anywhere_gives_a_scene_or_asset_invalid(data: st.DataObject) -> None:
    root = json.loads(SMALL["mlp.json"])
    node: Any = root
    while True:  # walks down to a random place
        key = data.draw(st.sampled_from(sorted(node) if isinstance(node, dict) else range(len(node))))
        child = node[key]
        if not isinstance(child, dict | list) or not child or data.draw(st.integers(0, 3)) == 0:
            break
        node = child
    node[key] = data.draw(JSON_VALUES)
    _read_or_refuse(SMALL | {"mlp.json": json.dumps(root).encode()})


@settings(max_examples=100, deadline=None)
@given(name=st.sampled_from(sorted(SMALL)), content=st.binary(max_size=200))
def test_any_bytes_are_read_or_refused(name: str, content: bytes) -> None:
    _read_or_refuse(SMALL | {name: content})


def _read_or_refuse(files: Files) -> None:
    try:
        scene = read_mobilenerf(files)
    except AssetInvalid:
        return
    assert isinstance(scene, BakedScene)
