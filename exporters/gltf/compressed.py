"""EXT_meshopt_compression, KHR_mesh_quantization and EXT_texture_webp: what browsers load, in the fewest bytes."""

from collections.abc import Sequence
from typing import Any

import meshopt
import numpy as np
import pygltflib as gltf

from core.baked import Page
from exporters.gltf.blob import ALIGNMENT, Blob
from exporters.gltf.document import WEBP
from exporters.gltf.meshopt_codec import MESHOPT, Mode
from exporters.gltf.quantization import steps_of
from exporters.gltf.storage import IMAGES_PER_PAGE, NamedImage, accessor, corners, index_types, primitive
from exporters.png import encode_png, middle_band
from exporters.threads import mapped
from exporters.webp import encode_webp

QUANTIZATION = "KHR_mesh_quantization"
# A texture coordinate is (x + 1/2) / 4096 or a coarser one: 13 bits and a sign, exactly.
TEXCOORD_BITS = 15
# Of a float position's largest coordinate, where the scene is too wide for whole steps.
POSITION_BITS = 18

# Of a scene's pages; images of larger ones are not tried as PNG, which is as slow and was never smaller.
TRIED_TEXELS = 1 << 23


class CompressedStorage:
    """Buffer 0 holds what is stored, buffer 1 stands for what it is decoded to (a fallback that is not there).

    Args:
        quantised: whether positions are multiples of 1/32767, see `quantization.quantised`.
    """

    def __init__(self, quantised: bool) -> None:
        self.blob = Blob()
        self._quantised, self._decoded_length, self._webp = quantised, 0, False

    def add_textures(self, document: gltf.GLTF2, images: Sequence[NamedImage]) -> None:
        texels = sum(image.pixels.shape[0] * image.pixels.shape[1] for image in images) // IMAGES_PER_PAGE
        files = mapped(lambda image: _encoded(image, texels), images)
        for image, (kind, data) in zip(images, files, strict=True):
            view = self.blob.append(data)
            document.images.append(gltf.Image(name=image.name, mimeType=f"image/{kind}", bufferView=view))
            source = len(document.images) - 1
            self._webp |= kind == "webp"
            document.textures.append(
                gltf.Texture(name=image.name, sampler=0, extensions={WEBP: {"source": source}})
                if kind == "webp"
                else gltf.Texture(name=image.name, sampler=0, source=source)
            )

    def add_mesh(self, document: gltf.GLTF2, page: Page) -> gltf.Primitive:
        page = in_order_of_use(page)
        first, count = len(document.accessors), len(page.positions)
        index_type, index_dtype = index_types(count)
        indices = page.triangles.ravel().astype(index_dtype)
        texcoords = meshopt.encode_filter_exp(np.asarray(page.texcoords, "<f4"), TEXCOORD_BITS, "SharedComponent")
        document.accessors += [
            self._positions(page.positions),
            accessor(self._attributes(texcoords, "EXPONENTIAL"), gltf.FLOAT, gltf.VEC2, count),
            accessor(
                self._append(indices, "TRIANGLES", gltf.ELEMENT_ARRAY_BUFFER), index_type, gltf.SCALAR, len(indices)
            ),
        ]
        return primitive(first)

    def finish(self, document: gltf.GLTF2) -> None:
        required = [MESHOPT, *([QUANTIZATION] if self._quantised else []), *([WEBP] if self._webp else [])]
        document.extensionsUsed = [*document.extensionsUsed, *required]
        document.extensionsRequired = required
        document.bufferViews = self.blob.views
        fallback = gltf.Buffer(byteLength=self._decoded_length, extensions={MESHOPT: {"fallback": True}})
        document.buffers = [gltf.Buffer(byteLength=self.blob.length), fallback]

    def _positions(self, positions: np.ndarray) -> gltf.Accessor:
        count = len(positions)
        if self._quantised:
            steps = steps_of(positions)
            padded = np.pad(steps, ((0, 0), (0, 1)))  # to a multiple of four bytes
            more: dict[str, Any] = {"normalized": True, **corners(steps)}
            return accessor(self._attributes(padded, None), gltf.SHORT, gltf.VEC3, count, **more)
        coded = meshopt.encode_filter_exp(np.asarray(positions, "<f4"), POSITION_BITS, "SharedVector")
        return accessor(
            self._attributes(coded, "EXPONENTIAL"), gltf.FLOAT, gltf.VEC3, count, **corners(decoded_exponential(coded))
        )

    def _attributes(self, rows: np.ndarray, kind: str | None) -> int:
        return self._append(rows, "ATTRIBUTES", gltf.ARRAY_BUFFER, kind)

    def _append(self, rows: np.ndarray, mode: Mode, target: int, kind: str | None = None) -> int:
        """A buffer view of rows that are stored compressed; `kind` is the filter that they went through."""
        stride = rows.itemsize * (1 if rows.ndim == 1 else rows.shape[1])
        stored = meshopt.encode_gltf_buffer(rows, mode)
        index = self.blob.append(stored, target)
        view = self.blob.views[index]
        coding: dict[str, Any] = {
            "buffer": 0,
            "byteOffset": view.byteOffset,
            "byteLength": len(stored),
            "byteStride": stride,
            "mode": mode,
            "count": len(rows),
        }
        view.extensions = {MESHOPT: coding | ({"filter": kind} if kind else {})}
        view.buffer, view.byteOffset, view.byteLength = 1, self._decoded_length, stride * len(rows)
        view.byteStride = stride if mode == "ATTRIBUTES" else None
        self._decoded_length += view.byteLength + -view.byteLength % ALIGNMENT
        return index


def in_order_of_use(page: Page) -> Page:
    """The page with its vertices numbered as the triangles first use them: two bytes a quad instead of six.

    Vertices that no triangle uses go.
    """
    used, first, inverse = np.unique(page.triangles, return_index=True, return_inverse=True)
    order = np.argsort(first)
    number = np.empty(len(order), np.uint32)
    number[order] = np.arange(len(order), dtype=np.uint32)
    vertices = used[order]
    return Page(
        page.features_u8,
        page.colors_u8,
        page.positions[vertices],
        page.texcoords[vertices],
        number[inverse].reshape(-1, 3),
    )


def decoded_exponential(rows: np.ndarray) -> np.ndarray:
    """float32 [n, k] of rows [n, 4 k] (uint8) with an exponent and a mantissa for each number, as the filter stores."""
    words = np.ascontiguousarray(rows).view("<i4")
    mantissa, exponent = (words << 8) >> 8, words >> 24
    return np.ldexp(mantissa.astype(np.float32), exponent)


def _encoded(image: NamedImage, scene_texels: int) -> tuple[str, bytes]:
    """("webp" or "png", the file): what is smaller on the middle rows."""

    def webp(pixels: np.ndarray) -> bytes:
        return encode_webp(pixels, exact=image.exact, scene_texels=scene_texels)

    if scene_texels > TRIED_TEXELS:
        return "webp", webp(image.pixels)
    band = middle_band(image.pixels)
    tried = [
        (len(data), kind, encode, data)
        for kind, encode in (("webp", webp), ("png", encode_png))
        for data in [encode(band)]
    ]
    _, kind, encode, data = min(tried, key=lambda each: each[0])
    return kind, data if len(band) == len(image.pixels) else encode(image.pixels)
