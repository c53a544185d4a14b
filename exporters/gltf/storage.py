"""Where images and meshes of a document go, and in which coding."""

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple, Protocol

import numpy as np
import pygltflib as gltf

from core.baked import Page
from exporters.gltf.blob import Blob
from exporters.png import encode_pngs

ImageStore = Callable[[str, bytes], gltf.Image]  # takes a PNG by its name; the glTF image that refers to it
IMAGES_PER_PAGE = 3  # features 0-3, features 4-7, fallback colour
PRIMITIVE_RESTART_U16 = 65535  # an index that glTF forbids


class NamedImage(NamedTuple):
    """uint8 [h, w, 4] pixels; `exact`: colours under alpha 0 count, too."""

    name: str
    pixels: np.ndarray
    exact: bool


class Storage(Protocol):
    """Adds to a document; what is binary goes to `blob`, or beside the file."""

    blob: Blob

    def add_textures(self, document: gltf.GLTF2, images: Sequence[NamedImage]) -> None:
        """One texture per image, in order."""

    def add_mesh(self, document: gltf.GLTF2, page: Page) -> gltf.Primitive:
        """Accessors of a page's mesh; the primitive has attributes and indices."""

    def finish(self, document: gltf.GLTF2) -> None:
        """Buffers and buffer views, once everything is there."""


class PlainStorage:
    """What every loader reads: PNG images, float attributes, no compression.

    Args:
        blob: the one buffer.
        image: where PNG files go.
    """

    def __init__(self, blob: Blob, image: ImageStore) -> None:
        self.blob, self._image = blob, image

    def add_textures(self, document: gltf.GLTF2, images: Sequence[NamedImage]) -> None:
        for (name, _, _), png in zip(images, encode_pngs([image.pixels for image in images]), strict=True):
            document.images.append(self._image(name, png))
            document.textures.append(gltf.Texture(name=name, sampler=0, source=len(document.images) - 1))

    def add_mesh(self, document: gltf.GLTF2, page: Page) -> gltf.Primitive:
        index_type, index_dtype = index_types(len(page.positions))
        positions = np.asarray(page.positions, "<f4")
        texcoords = np.asarray(page.texcoords, "<f4")
        indices = page.triangles.ravel().astype(index_dtype)
        blob, first = self.blob, len(document.accessors)
        views = (
            blob.append(positions, gltf.ARRAY_BUFFER),
            blob.append(texcoords, gltf.ARRAY_BUFFER),
            blob.append(indices, gltf.ELEMENT_ARRAY_BUFFER),
        )
        document.accessors += [
            accessor(views[0], gltf.FLOAT, gltf.VEC3, len(positions), **corners(positions)),
            accessor(views[1], gltf.FLOAT, gltf.VEC2, len(texcoords)),
            accessor(views[2], index_type, gltf.SCALAR, len(indices)),
        ]
        return primitive(first)

    def finish(self, document: gltf.GLTF2) -> None:
        document.bufferViews = self.blob.views
        document.buffers = [gltf.Buffer(byteLength=self.blob.length)]


def accessor(view: int, component_type: int, kind: str, count: int, **more: Any) -> gltf.Accessor:
    """The accessor of a whole buffer view."""
    return gltf.Accessor(bufferView=view, componentType=component_type, type=kind, count=count, **more)


def corners(values: np.ndarray) -> dict[str, list[float]]:
    """`min` and `max` of an accessor's values [V, 3]; whole numbers stay whole."""
    return {"min": values.min(0).tolist(), "max": values.max(0).tolist()}


def primitive(first: int) -> gltf.Primitive:
    """Positions, texture coordinates and indices in three accessors from `first` on."""
    return gltf.Primitive(attributes=gltf.Attributes(POSITION=first, TEXCOORD_0=first + 1), indices=first + 2)


def index_types(vertices: int) -> tuple[int, str]:
    """(component type, dtype) of indices into so many vertices."""
    narrow = vertices <= PRIMITIVE_RESTART_U16
    return (gltf.UNSIGNED_SHORT, "<u2") if narrow else (gltf.UNSIGNED_INT, "<u4")
