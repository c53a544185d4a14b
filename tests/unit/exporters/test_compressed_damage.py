"""Whatever a compressed file says, the reader returns a scene or AssetInvalid, and takes no memory on its word."""

import copy
from collections.abc import Callable
from contextlib import suppress
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from core.errors import AssetInvalid
from exporters.check import check_glb
from exporters.gltf import read_glb, write_web_glb
from exporters.gltf.meshopt_codec import MESHOPT
from tests.scenes import random_scene
from tests.unit.exporters.glb import join, split

Json = dict[str, Any]
SMALL = write_web_glb(random_scene(np.random.default_rng(5), 4))["scene.web.glb"]


def coding(document: Json, accessor: int) -> Json:
    """Of an accessor's buffer view: 0 positions, 1 texture coordinates, 2 indices."""
    return document["bufferViews"][document["accessors"][accessor]["bufferView"]]["extensions"][MESHOPT]


def view(document: Json, accessor: int) -> Json:
    return document["bufferViews"][document["accessors"][accessor]["bufferView"]]


DAMAGES: dict[str, Callable[[Json], Any]] = {
    "a gigabyte of vertices": lambda d: coding(d, 0).update(count=1 << 27),
    "endless vertices": lambda d: coding(d, 0).update(count=10**30),
    "negative count": lambda d: coding(d, 1).update(count=-1),
    "fewer vertices": lambda d: coding(d, 1).update(count=3),
    "count as text": lambda d: coding(d, 1).update(count="16"),
    "count as truth": lambda d: coding(d, 1).update(count=True),
    "odd stride": lambda d: coding(d, 0).update(byteStride=6),
    "stride of another type": lambda d: coding(d, 2).update(byteStride=8),
    "another mode": lambda d: coding(d, 2).update(mode="INDICES"),
    "mode of attributes": lambda d: coding(d, 2).update(mode="ATTRIBUTES"),
    "another filter": lambda d: coding(d, 1).update(filter="OCTAHEDRAL"),
    "beyond the file": lambda d: coding(d, 0).update(byteLength=10**9),
    "in the other buffer": lambda d: coding(d, 0).update(buffer=1),
    "cut off": lambda d: coding(d, 0).update(byteLength=9),
    "shifted": lambda d: coding(d, 0).update(byteOffset=coding(d, 0)["byteOffset"] + 1),
    "another length": lambda d: view(d, 0).update(byteLength=8),
    "another stride": lambda d: view(d, 0).update(byteStride=12),
    "extension as list": lambda d: view(d, 0).update(extensions={MESHOPT: []}),
    "shorts that are not normalised": lambda d: d["accessors"][0].pop("normalized"),
    "floats that are normalised": lambda d: d["accessors"][1].update(normalized=True),
    "image is a mesh": lambda d: d["images"][0].update(bufferView=d["accessors"][0]["bufferView"]),
    "texture without an image": lambda d: d["textures"][0].update(extensions={"EXT_texture_webp": {"source": 99}}),
}


@pytest.mark.parametrize("damage", DAMAGES.values(), ids=DAMAGES.keys())
def test_damaged_json_is_refused(damage: Callable[[Json], Any]) -> None:
    document, binary = split(SMALL)
    damage(document)
    with pytest.raises(AssetInvalid) as caught:
        read_glb(join(document, binary))
    assert caught.value.remedy
    assert any(finding.severity == "error" for finding in check_glb(join(document, binary)))


def test_undamaged_file_survives_being_taken_apart() -> None:
    assert read_glb(join(*split(SMALL))).quad_count == 4


@settings(max_examples=200, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(at=st.integers(0, 2**31), value=st.integers(0, 255))
def test_changed_bytes_are_refused_or_read(at: int, value: int) -> None:
    document, binary = split(SMALL)
    changed = bytearray(binary)
    changed[at % len(changed)] = value
    with suppress(AssetInvalid):
        read_glb(join(document, bytes(changed)))


@settings(max_examples=200, deadline=None)
@given(
    field=st.sampled_from(["buffer", "byteOffset", "byteLength", "byteStride", "count", "mode", "filter"]),
    accessor=st.integers(0, 2),
    value=st.sampled_from([None, True, -1, 0, 1, 3, 8, 255, 2**31, 10**30, 0.5, 1e300, "", "NONE", [], {}]),
)
def test_any_value_in_any_field_is_refused_or_read(field: str, accessor: int, value: Any) -> None:
    document, binary = split(SMALL)
    changed = copy.deepcopy(document)
    coding(changed, accessor)[field] = value
    with suppress(AssetInvalid):
        read_glb(join(changed, binary))
