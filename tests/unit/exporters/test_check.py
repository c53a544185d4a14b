"""The check says nothing of a good asset, names the fault of a bad one, and never raises."""

import copy
import io
import json
import struct
import tracemalloc
import zlib
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from PIL import Image

from core.baked import BakedScene
from exporters.check import Finding, check_glb, check_gltf, gl_compiler
from exporters.fallback import mean_colors
from exporters.gltf import write_glb, write_gltf
from exporters.gltf.extension import NAME
from exporters.png import decode_png, encode_png
from tests.scenes import random_network, random_scene, tiny_scene
from tests.unit.exporters.glb import join, split
from tests.unit.exporters.test_gltf_damage import JSON_VALUES

Json = dict[str, Any]


def trained_like(scene: BakedScene) -> BakedScene:
    """The scene with a network that depends on direction as little as trained ones do, and start camera 1."""
    first = scene.network.weights[0].copy()
    first[:, 8:] *= 0.1
    network = replace(scene.network, weights=(first, *scene.network.weights[1:]))
    pages = tuple(replace(page, colors_u8=mean_colors(network, page.features_u8)) for page in scene.pages)
    return replace(scene, pages=pages, network=network, start_camera=1)


GOOD = write_glb(trained_like(tiny_scene()))["scene.glb"]
SMALL = write_glb(random_scene(np.random.default_rng(5), 4))["scene.glb"]


def gentle(scene: BakedScene) -> BakedScene:
    """The scene with a network whose colours vary as little with its inputs as trained ones do."""
    network = random_network(np.random.default_rng(1), gain=0.5)
    pages = tuple(replace(page, colors_u8=mean_colors(network, page.features_u8)) for page in scene.pages)
    return replace(scene, pages=pages, network=network)


def accepts_all(vertex: str, fragment: str) -> str:
    return ""


def found_in(glb: bytes) -> list[Finding]:
    return check_glb(glb, accepts_all)


# --- ways to do damage: each takes the good file and returns a bad one


def in_json(change: Callable[[Json], Any]) -> Callable[[bytes], bytes]:
    def damage(glb: bytes) -> bytes:
        document, binary = split(glb)
        change(document)
        return join(document, binary)

    return damage


def in_array(accessor: int, change: Callable[[np.ndarray], Any]) -> Callable[[bytes], bytes]:
    """Changes an accessor's data: 0 positions, 1 texture coordinates, 2 indices, of the first page."""

    def damage(glb: bytes) -> bytes:
        document, binary = split(glb)
        stated = document["accessors"][accessor]
        view = document["bufferViews"][stated["bufferView"]]
        dtype = {5123: "<u2", 5125: "<u4", 5126: "<f4"}[stated["componentType"]]
        start, stop = view.get("byteOffset", 0), view.get("byteOffset", 0) + view["byteLength"]
        values = np.frombuffer(binary[start:stop], dtype).copy()
        change(values)
        return join(document, binary[:start] + values.tobytes() + binary[stop:])

    return damage


def with_png(index: int, make: Callable[[bytes], bytes]) -> Callable[[bytes], bytes]:
    """Replaces an image file: 0 features 0-3, 1 features 4-7, 2 fallback, of the first page."""

    def damage(glb: bytes) -> bytes:
        document, binary = split(glb)
        view = document["bufferViews"][document["images"][index]["bufferView"]]
        start = view.get("byteOffset", 0)
        png = make(binary[start : start + view["byteLength"]])
        view.update(byteOffset=len(binary), byteLength=len(png))
        binary += png + bytes(-len(png) % 4)
        document["buffers"][0]["byteLength"] = len(binary)
        return join(document, binary)

    return damage


def with_pixels(index: int, change: Callable[[np.ndarray], np.ndarray]) -> Callable[[bytes], bytes]:
    return with_png(index, lambda png: encode_png(change(decode_png(png, "image"))))


def in_shader(dialect: str, program: str, old: str, new: str) -> Callable[[bytes], bytes]:
    def change(document: Json) -> None:
        texts = network(document)["shaders"][dialect]["programs"][program]
        assert old in texts["fragment"]
        texts["fragment"] = texts["fragment"].replace(old, new)

    return in_json(change)


def network(document: Json) -> Json:
    return document["extensions"][NAME]["networks"][0]


def root(document: Json) -> Json:
    return document["extensions"][NAME]


def primitive(document: Json) -> Json:
    return document["meshes"][0]["primitives"][0]


def premultiplied(pixels: np.ndarray) -> np.ndarray:
    alpha = pixels[..., 3:].astype(float) / 255
    return np.concatenate([np.rint(pixels[..., :3] * alpha).astype(np.uint8), pixels[..., 3:]], -1)


def as_other_png(mode: str) -> Callable[[bytes], bytes]:
    def convert(png: bytes) -> bytes:
        file = io.BytesIO()
        Image.open(io.BytesIO(png)).convert("RGB").convert(mode).save(file, "PNG")
        return file.getvalue()

    return convert


def with_gamma(png: bytes) -> bytes:
    chunk = b"gAMA" + struct.pack(">I", 45455)
    return png[:33] + struct.pack(">I", 4) + chunk + struct.pack(">I", zlib.crc32(chunk)) + png[33:]


def gamma(pixels: np.ndarray) -> np.ndarray:
    curved = np.rint(255 * (pixels / 255.0) ** 2.2).astype(np.uint8)
    return np.where(pixels > 0, np.maximum(curved, 1), 0).astype(np.uint8)  # holes stay where they are


def with_width(width: int) -> Callable[[bytes], bytes]:
    """A PNG header of another width, its checksum correct."""

    def damage(png: bytes) -> bytes:
        header = b"IHDR" + struct.pack(">I", width) + png[20:29]
        return png[:12] + header + struct.pack(">I", zlib.crc32(header)) + png[33:]

    return damage


def without_binary(glb: bytes) -> bytes:
    (length,) = struct.unpack("<I", glb[12:16])
    return glb[:8] + struct.pack("<I", 20 + length) + glb[12 : 20 + length]


def odd_sized(pixels: np.ndarray) -> np.ndarray:
    return np.pad(pixels, ((0, 1), (0, 3), (0, 0)))


def all_images(change: Callable[[np.ndarray], np.ndarray]) -> Callable[[bytes], bytes]:
    def damage(glb: bytes) -> bytes:
        for index in range(3):
            glb = with_pixels(index, change)(glb)
        return glb

    return damage


def exchange_textures(document: Json) -> None:
    textures = primitive(document)["extensions"][NAME]["featureTextures"]
    textures.reverse()


def other_weights(document: Json) -> None:
    other = random_network(np.random.default_rng(99))
    for layer, weight, bias in zip(network(document)["layers"], other.weights, other.biases, strict=True):
        layer.update(weights=weight.tolist(), bias=bias.tolist())


# name: (damage, code of the finding, words in it)
FAULTS: dict[str, tuple[Callable[[bytes], bytes], str, str]] = {
    "empty file": (lambda glb: b"", "container", "binary glTF"),
    "another kind of file": (lambda glb: b"PK\x03\x04" + glb[4:], "container", "another format"),
    "glTF 1": (lambda glb: glb[:4] + b"\x01" + glb[5:], "container", "version"),
    "truncated file": (lambda glb: glb[:-100], "container", "header says"),
    "truncated chunk": (
        lambda glb: glb[:8] + struct.pack("<I", len(glb) - 400) + glb[12:-400],
        "container",
        "must lie within",
    ),
    "a header of 2 GiB": (lambda glb: glb[:8] + struct.pack("<I", 2**31) + glb[12:], "container", "2147483648"),
    "a chunk of 2 GiB": (lambda glb: glb[:12] + struct.pack("<I", 2**31) + glb[16:], "container", "2147483648"),
    "no binary chunk": (without_binary, "container", "binary chunk"),
    "buffer longer than it is": (in_json(lambda d: d["buffers"][0].update(byteLength=10**9)), "container", "states"),
    "glTF 1 in JSON": (in_json(lambda d: d["asset"].update(version="1.0")), "json", "2.0"),
    "no asset": (in_json(lambda d: d.pop("asset")), "json", "asset"),
    "JSON broken": (lambda glb: glb.replace(b'"asset"', b'"asset,', 1), "json", "JSON"),
    "weights NaN": (
        in_json(lambda d: network(d)["layers"][1]["weights"][2].__setitem__(3, float("nan"))),
        "network",
        "networks[0].layers[1].weights[2][3]",
    ),
    "transform infinite": (
        in_json(lambda d: d["nodes"][0].update(translation=[float("inf"), 0, 0])), "json", "nodes[0].translation[0]",
    ),
    "weights of another shape": (in_json(lambda d: network(d)["layers"][0]["weights"].pop()), "network", "shapes"),
    "another activation": (in_json(lambda d: network(d)["layers"][0].update(activation="tanh")), "network", "relu"),
    "no network": (in_json(lambda d: root(d).pop("networks")), "network", "networks"),
    "extension missing": (in_json(lambda d: d.pop("extensions")), "extension", NAME),
    "extension not listed": (in_json(lambda d: d["extensionsUsed"].remove(NAME)), "extension", "must list"),
    "extension required": (in_json(lambda d: d.update(extensionsRequired=[NAME])), "extension", "must not list"),
    "extension of others required": (
        in_json(lambda d: d.update(extensionsRequired=["KHR_draco_mesh_compression"])), "extension", "draco",
    ),
    "mesh on no node": (in_json(lambda d: d["nodes"][0]["children"].remove(1)), "frame", "meshes[0]"),
    "node below itself": (in_json(lambda d: d["nodes"][1].update(children=[0])), "frame", "several"),
    "background out of range": (in_json(lambda d: root(d).update(background=[2, 0, 0])), "background", "[0, 1]"),
    "object stretched": (in_json(lambda d: d["nodes"][0].update(scale=[1, 2, 1])), "frame", "one scale"),
    "user's frame sheared": (
        in_json(lambda d: root(d).update(userFromObject=[1, 0, 0, 0, 1, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1])),
        "frame", "userFromObject",
    ),
    "pose not rigid": (
        in_json(lambda d: root(d)["views"][0].update(objectFromCamera=[2.0] * 16)), "view", "rotation",
    ),
    "view without a camera": (in_json(lambda d: root(d)["views"][0].update(node=1)), "view", "cameras"),
    "view's node out of range": (in_json(lambda d: root(d)["views"][0].update(node=50)), "view", "50"),
    "start at no view": (in_json(lambda d: root(d).update(startView=9)), "view", "startView"),
    "missing image": (in_json(lambda d: d["images"].pop()), "texture", "images"),
    "image elsewhere": (in_json(lambda d: d["images"].__setitem__(0, {"uri": "x.png"})), "texture", "x.png"),
    "image of another kind than stated": (
        in_json(lambda d: d["images"][0].update(mimeType="image/webp")), "texture", "image/png",
    ),
    "image of 100,000 px": (with_png(0, with_width(100_000)), "texture", "100000"),
    "truncated image": (with_png(0, lambda png: png[: len(png) // 2]), "texture", "intact"),
    "image that is none": (with_png(1, lambda png: b"GIF89a" + png[6:]), "texture", "PNG"),
    "image without alpha": (with_png(0, as_other_png("RGB")), "texture", "RGBA"),
    "image with a palette": (with_png(1, as_other_png("P")), "texture", "RGBA"),
    "textures of two sizes": (with_pixels(1, odd_sized), "texture", "one size"),
    "wrong page size": (all_images(odd_sized), "mesh", "powers of two"),
    "image with a colour profile": (with_png(0, with_gamma), "texture", "gAMA"),
    "channels swapped": (with_pixels(1, lambda p: p[..., [2, 1, 0, 3]]), "feature", "second texture, red and blue"),
    "textures exchanged": (in_json(exchange_textures), "feature", "exchanged"),
    "alpha premultiplied": (with_pixels(1, premultiplied), "feature", "premultiplied"),
    "features through a gamma": (lambda glb: with_pixels(0, gamma)(with_pixels(1, gamma)(glb)), "feature", "converted"),
    "another network": (in_json(other_weights), "feature", "another one"),
    "other holes": (with_pixels(2, lambda p: np.roll(p, 3, 0)), "hole", "texels differ"),
    "index out of range": (in_array(2, lambda a: a.__setitem__(0, 60_000)), "mesh", "index 60000"),
    "position NaN": (in_array(0, lambda a: a.__setitem__(4, np.nan)), "mesh", "finite"),
    "bounds wrong": (in_json(lambda d: d["accessors"][0].update(max=[9, 9, 9])), "mesh", "max"),
    "texture coordinate outside": (in_array(1, lambda a: a.__setitem__(0, 1.5)), "mesh", "within [0, 1]"),
    "accessor beyond the buffer": (in_json(lambda d: d["accessors"][0].update(count=10**6)), "mesh", "bytes"),
    "no texture coordinates": (in_json(lambda d: primitive(d)["attributes"].pop("TEXCOORD_0")), "mesh", "TEXCOORD_0"),
    "vertices claimed": (in_json(lambda d: d["accessors"][0].update(count=2**31)), "mesh", "bytes"),
    "accessor that is not aligned": (
        in_json(lambda d: d["accessors"][0].update(byteOffset=2, count=d["accessors"][0]["count"] - 1)),
        "mesh", "multiple of 4",
    ),
    "half a triangle": (in_json(lambda d: d["accessors"][2].update(count=4)), "mesh", "three indices"),
    "no triangles": (in_json(lambda d: d["accessors"][2].update(count=0)), "mesh", "triangles"),
    "triangle strip": (in_json(lambda d: primitive(d).update(mode=5)), "mesh", "triangles"),
    "mesh folded flat": (in_array(0, lambda a: a.__setitem__(slice(None), 1.0)), "mesh", "area"),
    "no shaders": (in_json(lambda d: network(d).pop("shaders")), "shader", "must be among"),
    "a dialect missing": (in_json(lambda d: network(d)["shaders"].pop("essl300")), "shader", "essl300"),
    "another shader version": (
        in_json(lambda d: network(d)["shaders"]["glsl330"].update(version="120")), "shader", "330 core",
    ),
    "shader without a uniform": (
        in_shader("glsl330", "shade", "u_object_ray_from_ndc", "u_ray"), "shader", "u_object_ray_from_ndc",
    ),
    "shader of other weights": (in_shader("essl300", "forward", "vec4 a0 = ", "vec4 a0 = 0.5 * "), "shader", "weights"),
    "fallback blends": (in_json(lambda d: d["materials"][0].update(alphaMode="BLEND")), "fallback", "MASK"),
    "fallback filtered": (in_json(lambda d: d["samplers"][0].update(magFilter=9729)), "texture", "nearest"),
}  # fmt: skip


def test_good_asset_has_no_findings() -> None:
    assert found_in(GOOD) == []
    assert found_in(SMALL) == []


def test_there_are_thirty_faults_and_more() -> None:
    assert len(FAULTS) >= 30


@pytest.mark.parametrize(("damage", "code", "words"), FAULTS.values(), ids=FAULTS.keys())
def test_fault_is_named(damage: Callable[[bytes], bytes], code: str, words: str) -> None:
    findings = found_in(damage(GOOD))
    assert any(finding.code == code and words in str(finding) for finding in findings), findings
    assert len(findings) <= 4, findings  # the fault, not a flood


def test_fault_of_a_page_names_the_page() -> None:
    (finding,) = found_in(FAULTS["index out of range"][0](GOOD))
    assert str(finding) == "error [mesh] page 0, triangles: must index the 120 vertices, but got index 60000"


def test_every_fault_of_a_file_is_found() -> None:
    names = (
        "background out of range",
        "another activation",
        "bounds wrong",
        "other holes",
        "image with a colour profile",
    )
    glb = GOOD
    for name in names:
        glb = FAULTS[name][0](glb)
    assert {finding.code for finding in found_in(glb)} >= {FAULTS[name][1] for name in names}


def test_shader_that_does_not_compile_is_named() -> None:
    compiler = gl_compiler()
    if compiler is None:
        pytest.skip("no OpenGL here")
    assert check_glb(GOOD, compiler) == []
    broken = in_shader("essl300", "shade", "float covered = 0.0;", "float covered = vec2(0.0);")(GOOD)
    (finding,) = check_glb(broken, compiler)
    assert (finding.severity, finding.code, finding.subject) == ("error", "shader", "essl300, shade")
    assert "compile" in finding.message


def test_without_a_compiler_a_note_says_so() -> None:
    (finding,) = check_glb(GOOD)
    assert (finding.severity, finding.code) == ("note", "shader")
    assert "not compiled" in finding.message


def test_finding_reads_as_a_line() -> None:
    finding = Finding("error", "mesh", "page 0", "must have triangles")
    assert str(finding) == "error [mesh] page 0: must have triangles"


def test_gltf_with_files_is_checked_alike(scene: BakedScene) -> None:
    files = write_gltf(scene)
    assert check_gltf(files, accepts_all) == []
    assert check_gltf({}, accepts_all)[0].code == "container"
    findings = check_gltf({name: data for name, data in files.items() if name != "page0.color.png"}, accepts_all)
    assert any(finding.code == "texture" and "page0.color.png" in str(finding) for finding in findings)


def test_finding_is_one_line_whatever_the_file_has_put_into_it() -> None:
    finding = Finding("error", "texture", "a\nb\x1b[2J", "must be \ud800\u202e é")
    assert str(finding) == "error [texture] a\\nb\\x1b[2J: must be \\ud800\\u202e é"


CLAIMS = (
    "a header of 2 GiB",
    "a chunk of 2 GiB",
    "image of 100,000 px",
    "vertices claimed",
    "buffer longer than it is",
)


@pytest.mark.parametrize("name", CLAIMS)
def test_no_memory_is_taken_on_a_files_word(name: str) -> None:
    damaged = FAULTS[name][0](SMALL)
    found_in(damaged)  # what is loaded once
    tracemalloc.start()
    found_in(damaged)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 50_000_000  # what the check itself takes for 48 directions for each of 2048 texels; claimed is 1 GB


@settings(max_examples=200, deadline=None)
@given(st.binary(max_size=300))
def test_any_bytes_are_judged(data: bytes) -> None:
    assert found_in(data)


@settings(max_examples=100, deadline=None)
@given(st.binary(max_size=300), st.binary(max_size=300))
def test_any_chunks_are_judged(text: bytes, binary: bytes) -> None:
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<II", len(text), 0x4E4F534A) + text + struct.pack("<II", len(binary), 0x004E4942) + binary
    assert found_in(struct.pack("<III", 0x46546C67, 2, 12 + len(chunks)) + chunks)


@settings(max_examples=150, deadline=None)
@given(data=st.data())
def test_flipped_bytes_are_judged(data: st.DataObject) -> None:
    damaged = bytearray(SMALL)
    for _ in range(data.draw(st.integers(1, 4))):
        damaged[data.draw(st.integers(0, len(SMALL) - 1))] = data.draw(st.integers(0, 255))
    assert all(isinstance(finding, Finding) for finding in found_in(bytes(damaged)))


@settings(max_examples=200, deadline=None, suppress_health_check=[HealthCheck.data_too_large])
@given(data=st.data())
def test_any_json_value_anywhere_is_judged(data: st.DataObject) -> None:
    document, binary = split(SMALL)
    for shader in ("essl300", "glsl330"):
        network(document)["shaders"].pop(shader)
    node: Any = copy.deepcopy(document)
    top = node
    while True:  # walks down to a random place
        key = data.draw(st.sampled_from(sorted(node) if isinstance(node, dict) else range(len(node))))
        child = node[key]
        if not isinstance(child, dict | list) or not child or data.draw(st.integers(0, 3)) == 0:
            break
        node = child
    node[key] = data.draw(JSON_VALUES)
    assert all(isinstance(finding, Finding) for finding in found_in(join(top, binary)))


def test_number_that_is_none_is_found_wherever_it_is() -> None:
    document, binary = split(GOOD)
    root(document)["views"][1]["focalLength"][0] = float("-inf")
    (finding,) = found_in(join(document, binary))
    assert "views[1].focalLength[0]" in finding.subject
    assert json.dumps(document).count("Infinity") == 1
