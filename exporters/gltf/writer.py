"""A baked scene as one .glb, or as a .gltf with its files."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pygltflib as gltf

from core.baked import BakedScene, Page, similarity_scale
from core.conventions import is_opaque
from core.errors import SceneInvalid
from exporters.gltf import extension
from exporters.gltf.blob import Blob, glb_bytes
from exporters.gltf.cameras import camera_json
from exporters.gltf.placement import nearest_rotation, trs
from exporters.limits import check_size
from exporters.numbers import column_major
from exporters.png import encode_pngs

FILE_NAME = "scene.glb"
GLTF_NAME = "scene.gltf"
BUFFER_NAME = "scene.bin"
IMAGES_PER_PAGE = 3  # features 0-3, features 4-7, fallback colour
ALPHA_CUTOFF = 0.5
ImageStore = Callable[[str, bytes], gltf.Image]  # takes a PNG by its name; the glTF image that refers to it
_PRIMITIVE_RESTART_U16 = 65535  # an index that glTF forbids


def write_glb(scene: BakedScene) -> dict[str, bytes]:
    """`{"scene.glb": ...}`: the whole scene; `read_glb` returns it bit for bit (`asset_from_object`: as `trs` says).

    Viewers that do not know the extension show the pages' mean colours, unlit.

    Raises:
        SceneInvalid: the pages exceed what a reader accepts.
    """
    blob = Blob()

    def within(name: str, png: bytes) -> gltf.Image:
        return gltf.Image(name=name, mimeType="image/png", bufferView=blob.append(png))

    document = _document(scene, blob, within)
    text = document.gltf_to_json(separators=(",", ":"), indent=None).encode()
    return {FILE_NAME: glb_bytes(text, blob)}


def write_gltf(scene: BakedScene) -> dict[str, bytes]:
    """`scene.gltf`, `scene.bin` and a PNG per texture: what `write_glb` writes, for tools that want to see the parts.

    `read_gltf` returns the scene as `read_glb` does.

    Raises:
        SceneInvalid: the pages exceed what a reader accepts.
    """
    blob = Blob()
    files: dict[str, bytes] = {}

    def beside(name: str, png: bytes) -> gltf.Image:
        files[f"{name}.png"] = png
        return gltf.Image(name=name, mimeType="image/png", uri=f"{name}.png")

    document = _document(scene, blob, beside)
    document.buffers[0].uri = BUFFER_NAME
    return {GLTF_NAME: document.gltf_to_json().encode(), BUFFER_NAME: b"".join(blob.parts), **files}


def _document(scene: BakedScene, blob: Blob, image: ImageStore) -> gltf.GLTF2:
    """The whole document; what is binary is in `blob`, or where `image` puts it."""
    check_size([page.features_u8.shape[:2] for page in scene.pages], SceneInvalid)
    document = _empty_document()
    _add_pages(document, blob, scene, image)
    views = _add_cameras(document, scene)
    _add_object_node(document, scene)
    document.extensions = {extension.NAME: _root(scene, views)}
    document.bufferViews = blob.views
    document.buffers = [gltf.Buffer(byteLength=blob.length)]
    return document


def _empty_document() -> gltf.GLTF2:
    """Asset, one sampler, and a scene whose only root, node 0, is the object."""
    sampler = gltf.Sampler(
        magFilter=gltf.NEAREST, minFilter=gltf.NEAREST, wrapS=gltf.CLAMP_TO_EDGE, wrapT=gltf.CLAMP_TO_EDGE
    )
    return gltf.GLTF2(
        asset=gltf.Asset(version="2.0", generator="Polyfield"),
        extensionsUsed=["KHR_materials_unlit", extension.NAME],
        scene=0,
        scenes=[gltf.Scene(nodes=[0])],
        nodes=[gltf.Node(name="object", children=[])],
        samplers=[sampler],
    )


def _add_pages(document: gltf.GLTF2, blob: Blob, scene: BakedScene, image: ImageStore) -> None:
    pngs = encode_pngs([pixels for page in scene.pages for pixels in _page_images(page)])
    for number, page in enumerate(scene.pages):
        first = IMAGES_PER_PAGE * number
        for png, label in zip(pngs[first : first + 3], ("features0", "features1", "color"), strict=True):
            name = f"page{number}.{label}"
            document.images.append(image(name, png))
            document.textures.append(gltf.Texture(name=name, sampler=0, source=len(document.images) - 1))
        document.materials.append(_fallback_material(number, first + 2))
        primitive = _primitive(document, blob, page, number)
        primitive.extensions = {extension.NAME: extension.primitive_json((first, first + 1))}
        document.meshes.append(gltf.Mesh(name=f"page{number}", primitives=[primitive]))
        document.nodes.append(gltf.Node(name=f"page{number}", mesh=number))


def _page_images(page: Page) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The three RGBA images of a page; the fallback's alpha is 0 in holes, 255 elsewhere."""
    alpha = np.where(is_opaque(page.features_u8), np.uint8(255), np.uint8(0))[..., None]
    return page.features_u8[..., :4], page.features_u8[..., 4:], np.concatenate([page.colors_u8, alpha], -1)


def _fallback_material(number: int, color_texture: int) -> gltf.Material:
    """What stock viewers show. Ours is the primitive's: KHR_materials_unlit excludes other extensions on a material."""
    return gltf.Material(
        name=f"page{number}",
        alphaMode=gltf.MASK,
        alphaCutoff=ALPHA_CUTOFF,
        doubleSided=True,
        pbrMetallicRoughness=gltf.PbrMetallicRoughness(
            baseColorTexture=gltf.TextureInfo(index=color_texture), metallicFactor=0.0, roughnessFactor=1.0
        ),
        extensions={"KHR_materials_unlit": {}},
    )


def _primitive(document: gltf.GLTF2, blob: Blob, page: Page, material: int) -> gltf.Primitive:
    narrow = len(page.positions) <= _PRIMITIVE_RESTART_U16
    index_type, index_dtype = (gltf.UNSIGNED_SHORT, "<u2") if narrow else (gltf.UNSIGNED_INT, "<u4")
    positions = np.asarray(page.positions, "<f4")
    texcoords = np.asarray(page.texcoords, "<f4")
    indices = page.triangles.ravel().astype(index_dtype)
    corners: dict[str, Any] = {
        "min": [float(n) for n in positions.min(0)],
        "max": [float(n) for n in positions.max(0)],
    }
    first = len(document.accessors)
    document.accessors += [
        _accessor(blob.append(positions, gltf.ARRAY_BUFFER), gltf.FLOAT, gltf.VEC3, len(positions), **corners),
        _accessor(blob.append(texcoords, gltf.ARRAY_BUFFER), gltf.FLOAT, gltf.VEC2, len(texcoords)),
        _accessor(blob.append(indices, gltf.ELEMENT_ARRAY_BUFFER), index_type, gltf.SCALAR, len(indices)),
    ]
    attributes = gltf.Attributes(POSITION=first, TEXCOORD_0=first + 1)
    return gltf.Primitive(attributes=attributes, indices=first + 2, material=material)


def _accessor(view: int, component_type: int, kind: str, count: int, **corners: Any) -> gltf.Accessor:
    return gltf.Accessor(bufferView=view, componentType=component_type, type=kind, count=count, **corners)


def _root(scene: BakedScene, views: list[dict[str, Any]]) -> dict[str, Any]:
    """The extension of the glTF root; what has its default is left out."""
    root: dict[str, Any] = {
        "networks": [extension.network_json(scene.network)],
        "background": [float(c) for c in scene.background],
    }
    if views:
        root["views"] = views
    if scene.start_camera is not None:
        root["startView"] = int(scene.start_camera)
    if not np.array_equal(scene.user_from_object, np.eye(4)):
        root["userFromObject"] = column_major(scene.user_from_object)
    return root


def _add_cameras(document: gltf.GLTF2, scene: BakedScene) -> list[dict[str, Any]]:
    """Adds a camera and its node per view; returns the extension's exact views.

    The nodes take the object's scale back: clients do not agree on whether the scale above a camera counts.
    """
    lowest, highest = scene.bounds()
    scale = similarity_scale(scene.asset_from_object)
    views = []
    for camera in scene.cameras:
        document.cameras.append(camera_json(camera, scale * float(np.linalg.norm(highest - lowest))))
        place = np.eye(4)
        place[:3, :3] = nearest_rotation(camera.world_from_camera[:3, :3]) / scale
        place[:3, 3] = camera.position
        document.nodes.append(gltf.Node(name=camera.name, camera=len(document.cameras) - 1, **trs(place)))
        views.append(extension.view_json(camera, len(document.nodes) - 1))
    return views


def _add_object_node(document: gltf.GLTF2, scene: BakedScene) -> None:
    """Everything else hangs below node 0, so that cameras and meshes share the object frame."""
    place = trs(scene.asset_from_object)
    document.nodes[0] = gltf.Node(name="object", children=list(range(1, len(document.nodes))), **place)
