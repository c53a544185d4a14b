"""The check of a whole asset, area by area; a fault in one does not hide those in others."""

import json
import math
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import replace
from typing import Any

from core.baked import ShaderNetwork, check_similarity
from core.errors import AssetInvalid
from exporters.check.compiler import Compiler
from exporters.check.extensions import check_extensions
from exporters.check.finding import Findings
from exporters.check.page import check_page
from exporters.check.placement import check_hierarchy
from exporters.check.shaders import check_shaders
from exporters.gltf import extension, reader
from exporters.gltf.document import Document, chunks
from exporters.images import image_size
from exporters.invalid import invalid, only_asset_invalid
from exporters.limits import MAX_PAGES, check_size


def check_glb(data: bytes, compiler: Compiler | None = None) -> Findings:
    """Everything wrong with a .glb, worst area first as it is read; empty: nothing. Never raises, whatever the bytes.

    Args:
        compiler: compiles the shader texts, see `gl_compiler`; without one, a note says that they were not compiled.
    """
    found = Findings()
    parts = found.attempt("container", "file", chunks, data)
    if parts is not None:
        _check_padding(found, data)
        _check_text(found, parts[0], parts[1], {}, compiler)
    return found


def check_gltf(files: Mapping[str, bytes], compiler: Compiler | None = None) -> Findings:
    """As `check_glb`, for a .gltf and the files beside it, by name."""
    found = Findings()
    document = found.attempt("container", "files", Document.of_files, files)
    if document is not None:
        _check_document(found, document, compiler)
    return found


def _check_text(
    found: Findings, text: bytes, binary: bytes, files: Mapping[str, bytes], compiler: Compiler | None
) -> None:
    before = len(found)
    document = found.attempt("json", "glTF JSON", Document, text, binary, files)
    if document is not None:
        _check_document(found, document, compiler)
        return
    named = _numbers_that_are_none(text)
    if named:  # a parser says only that there is one
        del found[before:]
        found.error("network" if ".layers" in named[0] else "json", named[0], "must be a finite number, as JSON has")


def _check_padding(found: Findings, data: bytes) -> None:
    """glTF 2.0, section 4.4: chunks start and end on four bytes."""
    offset = 12
    while offset + 8 <= len(data):
        length = int.from_bytes(data[offset : offset + 4], "little")
        if length % 4:
            found.error("container", "chunk", f"must be a multiple of four bytes long, but got {length}")
        offset += 8 + length


def _check_document(found: Findings, document: Document, compiler: Compiler | None) -> None:
    found.attempt("json", "asset", _check_version, document)
    found.attempt("extension", "extension lists", check_extensions, found, document)
    found.attempt("container", "buffers", _check_buffer, found, document)
    root = found.attempt("extension", extension.NAME, reader.root_extension, document)
    if root is None:
        return
    found.attempt("background", "background", _check_background, root)
    found.attempt("frame", "object node", _check_object_node, document)
    found.attempt("frame", "userFromObject", _check_user_frame, root)
    found.attempt("frame", "nodes", check_hierarchy, found, document)
    found.attempt("view", "views", _check_views, document, root)
    network = found.attempt("network", "network", _network, root)
    if network is not None:
        found.attempt("shader", "shaders", check_shaders, found, reader.the_network(root), network, compiler)
    primitives = found.attempt("mesh", "meshes", _primitives, document)
    before = len(found)
    found.attempt("texture", "pages", _check_sizes, document, primitives or [])
    if len(found) > before:
        return
    for number, primitive in enumerate(primitives or []):
        name, of_page = f"page {number}", Findings()
        of_page.attempt("mesh", name, check_page, of_page, document, primitive, name, network)
        found += [one if name in one.subject else replace(one, subject=f"{name}, {one.subject}") for one in of_page]


def _check_version(document: Document) -> None:
    version = document.json["asset"]["version"]
    if version != "2.0":
        raise invalid("asset", "must have version 2.0", str(version)[:20])


def _check_buffer(found: Findings, document: Document) -> None:
    stated, there = document.item("buffers", 0).get("byteLength"), len(document.buffer())
    # The chunk may be padded by up to three bytes.
    if stated is None or not 0 <= there - stated < 4:
        found.error("container", "buffers[0]", f"must be as long as its data, {there} bytes, but states {stated}")


def _check_background(root: dict[str, Any]) -> None:
    background = reader.background_of(root)
    if not all(0 <= c <= 1 for c in background):
        raise invalid("background", "must be three numbers in [0, 1]", str(background))


def _check_object_node(document: Document) -> None:
    check_similarity("object node", reader.asset_from_object(document))


def _check_user_frame(root: dict[str, Any]) -> None:
    check_similarity("userFromObject", reader.user_from_object(root))


def _check_views(document: Document, root: dict[str, Any]) -> None:
    cameras = reader.cameras_of(document, root)
    for index, view in enumerate(root.get("views", [])):
        document.item("cameras", document.item("nodes", view["node"]).get("camera"))
        if view["node"] not in _object_node(document).get("children", []):
            raise invalid(f"views[{index}]", "must have a node that is a child of the object's", f"node {view['node']}")
    start = root.get("startView")
    if start is not None and not (type(start) is int and 0 <= start < len(cameras)):
        raise invalid("startView", f"must be one of the {len(cameras)} views", str(start)[:20])


def _object_node(document: Document) -> dict[str, Any]:
    (index,) = document.item("scenes", document.json.get("scene", 0))["nodes"]
    return document.item("nodes", index)


def _network(root: dict[str, Any]) -> ShaderNetwork:
    return extension.network_from_json(reader.the_network(root))


def _primitives(document: Document) -> list[dict[str, Any]]:
    primitives = reader.neural_primitives(document)
    if not 1 <= len(primitives) <= MAX_PAGES:
        raise invalid("meshes", f"must have 1 to {MAX_PAGES} primitives with the extension", str(len(primitives)))
    return primitives


def _check_sizes(document: Document, primitives: list[dict[str, Any]]) -> None:
    """Of all pages together: what keeps a small hostile file from filling the memory."""
    sizes = []
    for primitive in primitives:
        with suppress(AssetInvalid), only_asset_invalid("page"):  # each page is judged by itself later
            sizes.append(image_size(reader.page_files(document, primitive)[0], "page"))
    check_size(sizes, AssetInvalid)


def _numbers_that_are_none(text: bytes) -> list[str]:
    """Where JSON that Python can read, but nobody else, has NaN or infinity: "networks[0].layers[1].weights[2][3]"."""
    try:
        return [path.removeprefix(f"extensions.{extension.NAME}.") for path in _not_finite(json.loads(text), "")]
    except (ValueError, RecursionError):
        return []


def _not_finite(value: Any, path: str) -> Iterator[str]:
    if isinstance(value, float) and not math.isfinite(value):
        yield path
    elif isinstance(value, dict):
        for key, child in value.items():
            yield from _not_finite(child, f"{path}.{key}" if path else key)
    elif isinstance(value, list):
        for index, child in enumerate(value):
            yield from _not_finite(child, f"{path}[{index}]")
