"""The binary chunk while it is written."""

import numpy as np
import pygltflib as gltf

ALIGNMENT = 4  # bytes; enough for every component type of glTF


class Blob:
    """Bytes of one buffer and the buffer views on them.

    Attributes:
        data: a multiple of four bytes long after every append.
        views: one per append, in order.
    """

    def __init__(self) -> None:
        self.data = bytearray()
        self.views: list[gltf.BufferView] = []

    def append(self, content: bytes | np.ndarray, target: int | None = None) -> int:
        """Adds a buffer view; returns its index. `target` is ARRAY_BUFFER, ELEMENT_ARRAY_BUFFER or None (images)."""
        raw = content.tobytes() if isinstance(content, np.ndarray) else content
        view = gltf.BufferView(buffer=0, byteOffset=len(self.data), byteLength=len(raw), target=target)
        self.views.append(view)
        self.data += raw
        self.data += bytes(-len(self.data) % ALIGNMENT)
        return len(self.views) - 1
