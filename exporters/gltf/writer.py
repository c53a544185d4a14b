"""A baked scene as one .glb."""

from typing import Any

import numpy as np
import pygltflib as gltf

from core.baked import BakedScene, Page
from core.conventions import is_opaque
from core.errors import SceneInvalid
from exporters.gltf import extension
from exporters.gltf.blob import Blob
from exporters.gltf.cameras import camera_json, nearest_rigid
from exporters.gltf.limits import check_size
from exporters.gltf.png import encode_pngs

FILE_NAME = "scene.glb"
IMAGES_PER_PAGE = 3  # features 0-3, features 4-7, fallback colour
ALPHA_CUTOFF = 0.5
SIMILARITY_TOLERANCE = 1e-6
_PRIMITIVE_RESTART_U16 = 65535  # an index that glTF forbids


def write_glb(scene: BakedScene) -> dict[str, bytes]:
    """`{"scene.glb": ...}`: the whole scene; `read_glb` returns it bit for bit.

    Viewers that do not know the extension show the pages' mean colours, unlit.

    Raises:
        SceneInvalid: asset_from_object is not a similarity, or the pages exceed what a reader accepts.
    """
    _check_similarity(scene.asset_from_object)
    check_size([page.features_u8.shape[:2] for page in scene.pages], SceneInvalid)
    blob = Blob()
    document = _empty_document()
    _add_pages(document, blob, scene)
    views = _add_cameras(document, scene)
    _add_object_node(document, scene)
    root = {
        "networks": [extension.network_json(scene.network)],
        "background": [float(c) for c in scene.background],
        "views": views,
    }
    document.extensions = {extension.NAME: root if views else {k: v for k, v in root.items() if k != "views"}}
    document.bufferViews = blob.views
    document.buffers = [gltf.Buffer(byteLength=len(blob.data))]
    document.set_binary_blob(bytes(blob.data))
    return {FILE_NAME: b"".join(document.save_to_bytes())}


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


def _add_pages(document: gltf.GLTF2, blob: Blob, scene: BakedScene) -> None:
    images = [image for page in scene.pages for image in _page_images(page)]
    pngs = encode_pngs(images)
    for number, page in enumerate(scene.pages):
        first = IMAGES_PER_PAGE * number
        for png, label in zip(pngs[first : first + 3], ("features0", "features1", "color"), strict=True):
            name = f"page{number}.{label}"
            document.images.append(gltf.Image(name=name, mimeType="image/png", bufferView=blob.append(png)))
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


def _add_cameras(document: gltf.GLTF2, scene: BakedScene) -> list[dict[str, Any]]:
    """Adds a camera and its node per view; returns the extension's exact views."""
    lowest, highest = scene.bounds()
    views = []
    for camera in scene.cameras:
        document.cameras.append(camera_json(camera, float(np.linalg.norm(highest - lowest))))
        matrix = _node_matrix(nearest_rigid(camera.world_from_camera))
        document.nodes.append(gltf.Node(name=camera.name, camera=len(document.cameras) - 1, matrix=matrix))
        views.append(extension.view_json(camera, len(document.nodes) - 1))
    return views


def _add_object_node(document: gltf.GLTF2, scene: BakedScene) -> None:
    """Everything else hangs below node 0, so that cameras and meshes share the object frame."""
    document.nodes[0].children = list(range(1, len(document.nodes)))
    document.nodes[0].matrix = _node_matrix(scene.asset_from_object)


def _node_matrix(matrix: np.ndarray) -> list[float] | None:
    """A node's matrix; none for the identity, which is glTF's default."""
    return None if np.array_equal(matrix, np.eye(4)) else extension.column_major(matrix)


def _check_similarity(matrix: np.ndarray) -> None:
    block = matrix[:3, :3]
    scale = np.cbrt(np.linalg.det(block))
    similar = scale > 0 and np.allclose(block.T @ block / scale**2, np.eye(3), atol=SIMILARITY_TOLERANCE)
    if not similar or not np.array_equal(matrix[3], [0, 0, 0, 1]):
        raise SceneInvalid(
            "asset_from_object", "must be a rotation, a translation and one positive scale", str(matrix.tolist())
        )
