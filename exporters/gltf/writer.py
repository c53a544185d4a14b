"""A baked scene as one .glb, plain or compressed, or as a .gltf with its files."""

from typing import Any

import numpy as np
import pygltflib as gltf

from core.baked import BakedScene, Page, similarity_scale
from core.conventions import is_opaque
from core.errors import SceneInvalid
from exporters.compaction import PHONE, WEB, compacted
from exporters.gltf import extension
from exporters.gltf.blob import Blob, glb_bytes
from exporters.gltf.cameras import camera_json
from exporters.gltf.compressed import CompressedStorage
from exporters.gltf.placement import nearest_rotation, trs
from exporters.gltf.provenance import Provenance, add_provenance
from exporters.gltf.quantization import quantised
from exporters.gltf.storage import IMAGES_PER_PAGE, NamedImage, PlainStorage, Storage
from exporters.limits import check_size
from exporters.numbers import column_major
from exporters.threads import mapped

FILE_NAME = "scene.glb"
WEB_NAME = "scene.web.glb"
LQ_NAME = "scene.lq.glb"
GLTF_NAME = "scene.gltf"
BUFFER_NAME = "scene.bin"
ALPHA_CUTOFF = 0.5


def write_glb(scene: BakedScene, provenance: Provenance | None = None) -> dict[str, bytes]:
    """`{"scene.glb": ...}`: the whole scene; `read_glb` returns it bit for bit (`asset_from_object`: as `trs` says).

    Viewers that do not know the extension show the pages' mean colours, unlit.

    Args:
        provenance: what is known about where the asset comes from; kept as KHR_xmp_json_ld.

    Raises:
        SceneInvalid: the pages exceed what a reader accepts.
    """
    blob = Blob()

    def within(name: str, png: bytes) -> gltf.Image:
        return gltf.Image(name=name, mimeType="image/png", bufferView=blob.append(png))

    return {FILE_NAME: _glb(scene, PlainStorage(blob, within), provenance)}


def write_gltf(scene: BakedScene, provenance: Provenance | None = None) -> dict[str, bytes]:
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

    document = _document(scene, PlainStorage(blob, beside), provenance)
    document.buffers[0].uri = BUFFER_NAME
    return {GLTF_NAME: document.gltf_to_json().encode(), BUFFER_NAME: b"".join(blob.parts), **files}


def write_web_glb(scene: BakedScene, provenance: Provenance | None = None) -> dict[str, bytes]:
    """`{"scene.web.glb": ...}`: the scene in the fewest bytes that look the same, for browsers.

    The scene is `compacted` (WEB); images are lossless WebP, meshes compressed (EXT_meshopt_compression) with
    quantised positions. Loaders have to know these extensions. `read_glb` returns the compacted scene, in an object
    frame of its own (`quantised`).

    Raises:
        SceneInvalid: the pages exceed what a reader accepts.
    """
    return {WEB_NAME: _compressed_glb(compacted(scene, WEB), provenance)}


def write_lq_glb(scene: BakedScene, provenance: Provenance | None = None) -> dict[str, bytes]:
    """`{"scene.lq.glb": ...}`: as `write_web_glb`, with half the texels along each side of a quad, for phones."""
    return {LQ_NAME: _compressed_glb(compacted(scene, PHONE), provenance)}


def _compressed_glb(scene: BakedScene, provenance: Provenance | None) -> bytes:
    rounded = quantised(scene)
    return _glb(rounded or scene, CompressedStorage(quantised=rounded is not None), provenance)


def _glb(scene: BakedScene, storage: Storage, provenance: Provenance | None) -> bytes:
    document = _document(scene, storage, provenance)
    return glb_bytes(document.gltf_to_json(separators=(",", ":"), indent=None).encode(), storage.blob)


def _document(scene: BakedScene, storage: Storage, provenance: Provenance | None) -> gltf.GLTF2:
    """The whole document; what is binary is where `storage` puts it."""
    check_size([page.features_u8.shape[:2] for page in scene.pages], SceneInvalid)
    document = _empty_document()
    _add_pages(document, scene, storage)
    views = _add_cameras(document, scene)
    _add_object_node(document, scene)
    document.extensions = {extension.NAME: _root(scene, views)}
    storage.finish(document)
    if provenance is not None:
        add_provenance(document, provenance)
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


def _add_pages(document: gltf.GLTF2, scene: BakedScene, storage: Storage) -> None:
    images = mapped(lambda numbered: _page_images(numbered[1], f"page{numbered[0]}"), enumerate(scene.pages))
    storage.add_textures(document, [image for of_page in images for image in of_page])
    for number, page in enumerate(scene.pages):
        first = IMAGES_PER_PAGE * number
        document.materials.append(_fallback_material(number, first + 2))
        primitive = storage.add_mesh(document, page)
        primitive.material = number
        primitive.extensions = {extension.NAME: extension.primitive_json((first, first + 1))}
        document.meshes.append(gltf.Mesh(name=f"page{number}", primitives=[primitive]))
        document.nodes.append(gltf.Node(name=f"page{number}", mesh=number))


def _page_images(page: Page, name: str) -> tuple[NamedImage, NamedImage, NamedImage]:
    """The three RGBA images of a page; the fallback's alpha is 0 in holes, 255 elsewhere."""
    alpha = np.where(is_opaque(page.features_u8), np.uint8(255), np.uint8(0))[..., None]
    return (
        NamedImage(f"{name}.features0", page.features_u8[..., :4], exact=True),
        NamedImage(f"{name}.features1", page.features_u8[..., 4:], exact=True),
        NamedImage(f"{name}.color", np.concatenate([page.colors_u8, alpha], -1), exact=False),
    )


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
