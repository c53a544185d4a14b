"""The binary chunk while it is written."""

import struct

import numpy as np
import pygltflib as gltf

ALIGNMENT = 4  # bytes; enough for every component type of glTF


class Blob:
    """Bytes of one buffer and the buffer views on them. Joined only once: four full pages may take a gigabyte.

    Attributes:
        parts: the bytes, in order.
        length: of all parts together, a multiple of four after every append.
        views: one per append, in order.
    """

    def __init__(self) -> None:
        self.parts: list[bytes] = []
        self.length = 0
        self.views: list[gltf.BufferView] = []

    def append(self, content: bytes | np.ndarray, target: int | None = None) -> int:
        """Adds a buffer view; returns its index. `target` is ARRAY_BUFFER, ELEMENT_ARRAY_BUFFER or None (images)."""
        raw = content.tobytes() if isinstance(content, np.ndarray) else content
        view = gltf.BufferView(buffer=0, byteOffset=self.length, byteLength=len(raw), target=target)
        self.views.append(view)
        padding = bytes(-len(raw) % ALIGNMENT)
        self.parts += [raw, padding]
        self.length += len(raw) + len(padding)
        return len(self.views) - 1


def glb_bytes(text: bytes, blob: Blob) -> bytes:
    """A .glb of glTF JSON and its buffer (glTF 2.0 specification, section 4)."""
    text += b" " * (-len(text) % ALIGNMENT)
    length = 12 + 8 + len(text) + 8 + blob.length
    head = struct.pack("<4sIII4s", b"glTF", 2, length, len(text), b"JSON")
    return b"".join([head, text, struct.pack("<I4s", blob.length, b"BIN\0"), *blob.parts])
