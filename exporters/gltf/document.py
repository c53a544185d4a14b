"""A glTF file taken apart, with every access checked."""

import json
import struct
from collections.abc import Mapping
from typing import Any
from urllib.parse import unquote

import numpy as np

from exporters.gltf.meshopt_codec import MESHOPT, decoded
from exporters.invalid import invalid

WEBP = "EXT_texture_webp"
_MAGIC = 0x46546C67  # "glTF"
_JSON = 0x4E4F534A
_BIN = 0x004E4942
_HEADER = struct.Struct("<III")
_CHUNK = struct.Struct("<II")
SHORT = 5122
_COMPONENTS: dict[int, np.dtype[Any]] = {
    5121: np.dtype("u1"),
    SHORT: np.dtype("<i2"),
    5123: np.dtype("<u2"),
    5125: np.dtype("<u4"),
    5126: np.dtype("<f4"),
}
_WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3}


class Document:
    """glTF JSON, and the bytes that it refers to.

    Attributes:
        json: the JSON.
        binary: the binary chunk of a .glb, without padding rules checked; None of a .gltf.
        files: what URIs may name.

    Raises:
        AssetInvalid
    """

    def __init__(self, text: bytes, binary: bytes | None, files: Mapping[str, bytes]) -> None:
        self.binary, self.files = binary, files
        try:
            self.json: dict[str, Any] = json.loads(text, parse_constant=_refuse_constant)
        except (ValueError, RecursionError) as error:  # UnicodeDecodeError and JSONDecodeError are ValueErrors
            raise invalid("glTF JSON", "must be valid JSON", str(error)[:120]) from error
        if not isinstance(self.json, dict):
            raise invalid("glTF JSON", "must be an object", type(self.json).__name__)

    @classmethod
    def of_glb(cls, data: bytes) -> "Document":
        """Of a .glb: everything is within."""
        text, binary = chunks(data)
        return cls(text, binary, {})

    @classmethod
    def of_files(cls, files: Mapping[str, bytes]) -> "Document":
        """Of a .gltf and the files beside it, by name; all in one folder, which may be part of the names."""
        names = [name for name in files if name.endswith(".gltf")]
        if len(names) != 1:
            raise invalid("files", "must have one .gltf", f"{len(names)}")
        folder = names[0].rpartition("/")[0]
        beside = {name.removeprefix(f"{folder}/"): data for name, data in files.items()} if folder else files
        return cls(files[names[0]], None, beside)

    def item(self, kind: str, index: Any) -> dict[str, Any]:
        """`json[kind][index]`, an object."""
        items = self.json.get(kind)
        if not isinstance(items, list):
            raise invalid(f"glTF JSON, {kind}", "must be an array", type(items).__name__)
        valid = isinstance(index, int) and not isinstance(index, bool) and 0 <= index < len(items)
        if not valid or not isinstance(items[index], dict):
            raise invalid(f"glTF JSON, {kind}", f"must have an object at {str(index)[:20]}", f"{len(items)} items")
        found: dict[str, Any] = items[index]
        return found

    def view_bytes(self, index: Any) -> memoryview:
        """The bytes of a buffer view that is neither strided nor compressed."""
        view = self.item("bufferViews", index)
        if "byteStride" in view or MESHOPT in view.get("extensions", {}):
            raise invalid(f"bufferViews[{index}]", "must lie unstrided in buffer 0", str(view)[:80])
        return self._stored(view, f"bufferViews[{index}]")

    def accessor(self, index: Any, width: str, components: tuple[int, ...]) -> np.ndarray:
        """[count, n] (or [count] for SCALAR) of an accessor whose type and component type must be as given.

        Shorts must be normalised and come as they are stored; nothing else may be normalised.
        """
        accessor = self.item("accessors", index)
        subject = f"accessors[{index}]"
        component: Any = accessor.get("componentType")
        count: Any = accessor.get("count")
        plain = "sparse" not in accessor and accessor.get("normalized", False) is (component == SHORT)
        if accessor.get("type") != width or component not in components or not plain:
            raise invalid(subject, f"must be a plain {width} of component type {components}", str(accessor)[:80])
        if not _is_length(count):
            raise invalid(subject, "must have a count", str(count)[:20])
        dtype: np.dtype[Any] = np.dtype(_COMPONENTS[component])
        content, stride = self._rows(accessor.get("bufferView"))
        length = _WIDTHS[width] * dtype.itemsize
        if stride is None or stride == length:
            content = _slice(content, accessor.get("byteOffset", 0), count * length, subject)
            values = np.frombuffer(bytes(content), dtype)
        else:
            content = _slice(content, accessor.get("byteOffset", 0), count * stride, subject)
            rows = np.frombuffer(bytes(content), np.uint8).reshape(count, stride)
            values = np.ascontiguousarray(rows[:, :length]).view(dtype).ravel()
        return values if width == "SCALAR" else values.reshape(count, _WIDTHS[width])

    def _rows(self, index: Any) -> tuple[memoryview, int | None]:
        """(content, bytes from row to row or None: tightly packed) of an accessor's buffer view."""
        view, subject = self.item("bufferViews", index), f"bufferViews[{index}]"
        coding = view.get("extensions", {}).get(MESHOPT)
        if coding is not None:
            content, size = decoded(coding, self._stored(coding, subject), subject)
            if len(content) != view.get("byteLength") or view.get("byteStride", size) != size:
                raise invalid(subject, f"must be the {len(content)} bytes that are stored", str(view)[:80])
            return content, size
        stride = view.get("byteStride")
        if stride is not None and not (_is_length(stride) and 4 <= stride <= 252):
            raise invalid(subject, "must have a stride of 4 to 252", str(stride)[:20])
        return self._stored(view, subject), stride

    def _stored(self, place: dict[str, Any], subject: str) -> memoryview:
        """What lies in buffer 0, the only one with content, where `place` says."""
        if place.get("buffer") != 0:
            raise invalid(subject, "must lie in buffer 0", str(place)[:80])
        return _slice(memoryview(self.buffer()), place.get("byteOffset", 0), place.get("byteLength"), subject)

    def image_bytes(self, texture: Any) -> bytes:
        """The image file behind a texture; its WebP (EXT_texture_webp) where it has one."""
        content = self.item("textures", texture)
        image = self.item("images", content.get("extensions", {}).get(WEBP, content).get("source"))
        return self._file(image["uri"]) if "uri" in image else bytes(self.view_bytes(image.get("bufferView")))

    def buffer(self) -> bytes:
        """Of buffer 0, which is the only one that is read."""
        buffer = self.item("buffers", 0)
        if "uri" in buffer:
            return self._file(buffer["uri"])
        if self.binary is None:
            raise invalid("buffers[0]", "must name its file", "no uri")
        return self.binary

    def _file(self, uri: Any) -> bytes:
        name = unquote(uri) if isinstance(uri, str) else ""
        if name not in self.files:
            rule = "must be within the file" if self.binary is not None else "must be among the files given"
            raise invalid(str(uri)[:80], rule, "a reference to another file")
        return self.files[name]


def chunks(data: bytes) -> tuple[bytes, bytes]:
    """(JSON chunk, binary chunk) of a .glb (glTF 2.0 specification, section 4)."""
    if len(data) < _HEADER.size:
        raise invalid("file", "must be a binary glTF file", f"{len(data)} bytes")
    magic, version, length = _HEADER.unpack_from(data)
    if magic != _MAGIC or version != 2:
        raise invalid("file", "must be a binary glTF 2.0 file", "another format or version")
    if length != len(data):
        raise invalid("file", f"must be {length} bytes long, as its header says", f"{len(data)} bytes")
    chunks: dict[int, bytes] = {}
    offset = _HEADER.size
    while offset < length:
        header = _slice(memoryview(data), offset, _CHUNK.size, "chunk header")
        size, kind = _CHUNK.unpack(header)
        content = _slice(memoryview(data), offset + _CHUNK.size, size, "chunk")
        chunks.setdefault(kind, bytes(content))
        offset += _CHUNK.size + size
    if _JSON not in chunks or _BIN not in chunks:
        raise invalid("file", "must have a JSON chunk and a binary chunk", f"{len(chunks)} chunks")
    return chunks[_JSON], chunks[_BIN]


def _slice(data: memoryview, offset: Any, length: Any, subject: str) -> memoryview:
    if not _is_length(offset) or not _is_length(length) or offset + length > len(data):
        raise invalid(subject, f"must lie within {len(data)} bytes", f"{length} bytes from {offset}"[:80])
    return data[offset : offset + length]


def _is_length(value: Any) -> bool:
    return isinstance(value, int) and not isinstance(value, bool) and value >= 0


def _refuse_constant(name: str) -> float:
    raise ValueError(f"{name} is not a JSON number")
