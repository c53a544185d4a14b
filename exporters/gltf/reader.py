"""A .glb or .gltf with POLYFIELD_materials_neural, back as the baked scene it was written from."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from core.baked import BakedScene, Page
from core.camera import Camera
from core.conventions import is_opaque
from core.errors import AssetInvalid
from exporters.glsl import ShaderSources
from exporters.gltf import extension
from exporters.gltf.document import SHORT, Document
from exporters.gltf.placement import node_matrix
from exporters.gltf.quantization import positions_of
from exporters.images import decode_images, image_size
from exporters.invalid import invalid, only_asset_invalid
from exporters.limits import check_size
from exporters.numbers import matrix_from_column_major, numbers

_FLOAT = (5126,)
_POSITION = (SHORT, 5126)
_INDEX = (5121, 5123, 5125)
_WHITE = [1.0, 1.0, 1.0]


def read_glb(data: bytes) -> BakedScene:
    """The scene in a .glb written by `write_glb`, bit for bit (`asset_from_object`: as `placement.trs` says).

    Of `write_web_glb` and `write_lq_glb`, the scene as they changed it; colours under holes are undefined there.

    Raises:
        AssetInvalid: damaged, or not a file of this kind. Nothing else, whatever the bytes.
    """
    with only_asset_invalid(extension.NAME):
        return _scene(Document.of_glb(data))


def read_gltf(files: Mapping[str, bytes]) -> BakedScene:
    """The scene in a .gltf and its files, by name, as `read_glb`.

    Raises:
        AssetInvalid: as above; also where files are missing.
    """
    with only_asset_invalid(extension.NAME):
        return _scene(Document.of_files(files))


def read_shaders(data: bytes) -> dict[str, ShaderSources]:
    """The shader texts stored in a .glb, unchanged, by dialect ("essl300", "glsl330").

    Raises:
        AssetInvalid
    """
    with only_asset_invalid(extension.NAME):
        return extension.shaders_from_json(the_network(root_extension(Document.of_glb(data))))


def _scene(document: Document) -> BakedScene:
    root = root_extension(document)
    return BakedScene(
        pages=_pages(document),
        network=extension.network_from_json(the_network(root)),
        background=background_of(root),
        asset_from_object=asset_from_object(document),
        cameras=cameras_of(document, root),
        user_from_object=user_from_object(root),
        start_camera=root.get("startView"),
    )


def root_extension(document: Document) -> dict[str, Any]:
    """The extension's object of the glTF root."""
    root: dict[str, Any] | None = document.json.get("extensions", {}).get(extension.NAME)
    if root is None:
        raise invalid("file", f"must have the extension {extension.NAME}", "a glTF file without it")
    return root


def the_network(root: dict[str, Any]) -> dict[str, Any]:
    """JSON of the network, of which there must be one."""
    networks = root["networks"]
    if len(networks) != 1:
        raise invalid("networks", "must be exactly one", str(len(networks)))
    network: dict[str, Any] = networks[0]
    return network


def background_of(root: dict[str, Any]) -> tuple[float, float, float]:
    """sRGB; white where the file does not say."""
    red, green, blue = numbers(root.get("background", _WHITE), "background").tolist()
    return red, green, blue


def asset_from_object(document: Document) -> np.ndarray:
    """The transform of the scene's root node, the object."""
    (root,) = document.item("scenes", document.json.get("scene", 0))["nodes"]
    return node_matrix(document.item("nodes", root), "object node")


def user_from_object(root: dict[str, Any]) -> np.ndarray:
    """Files from before the property was there are in the user's frame."""
    if "userFromObject" not in root:
        return np.eye(4)
    return matrix_from_column_major(root["userFromObject"], "userFromObject")


def cameras_of(document: Document, root: dict[str, Any]) -> tuple[Camera, ...]:
    """The extension's views, named by their nodes."""
    views = root.get("views", [])
    return tuple(extension.view_from_json(v, str(document.item("nodes", v["node"]).get("name", ""))) for v in views)


def _pages(document: Document) -> tuple[Page, ...]:
    found = [(primitive, page_files(document, primitive)) for primitive in neural_primitives(document)]
    check_size((image_size(files[0], "feature texture") for _, files in found), AssetInvalid)
    return tuple(_page(document, primitive, files) for primitive, files in found)


def neural_primitives(document: Document) -> list[dict[str, Any]]:
    """The primitives with the extension, one per page, in the order of the meshes."""
    primitives = [primitive for mesh in document.json.get("meshes", []) for primitive in mesh["primitives"]]
    return [primitive for primitive in primitives if extension.NAME in primitive.get("extensions", {})]


def page_files(document: Document, primitive: dict[str, Any]) -> list[bytes]:
    """The image files of features 0-3, features 4-7 and the fallback colour; equal sizes, nothing decoded yet."""
    neural = primitive["extensions"][extension.NAME]
    if neural["coding"] != extension.CODING or neural["network"] != 0:
        raise invalid("neural primitive", f"must have coding {extension.CODING} and network 0", str(neural)[:80])
    features0, features1 = (texture["index"] for texture in neural["featureTextures"])
    material = document.item("materials", primitive.get("material"))
    color = material["pbrMetallicRoughness"]["baseColorTexture"]["index"]
    files = [document.image_bytes(index) for index in (features0, features1, color)]
    sizes = [image_size(file, "page's texture") for file in files]
    if len(set(sizes)) != 1:
        raise invalid("page's textures", "must have one size", str(sizes))
    return files


def _page(document: Document, primitive: dict[str, Any], files: list[bytes]) -> Page:
    features0, features1, color = decode_images(files, "page's texture")
    features_u8 = np.concatenate([features0, features1], -1)
    if not np.array_equal(color[..., 3] > 0, is_opaque(features_u8)):
        raise invalid("page's textures", "must agree on where holes are", "a fallback with other holes")
    return Page(features_u8, np.ascontiguousarray(color[..., :3]), *mesh_of(document, primitive))


def mesh_of(document: Document, primitive: dict[str, Any]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(positions float32 [V, 3], texcoords float32 [V, 2], triangles uint32 [T, 3]); indices are not checked yet."""
    if primitive.get("mode", 4) != 4:
        raise invalid("primitive", "must be of triangles", f"mode {str(primitive['mode'])[:20]}")
    attributes = primitive["attributes"]
    indices = document.accessor(primitive["indices"], "SCALAR", _INDEX)
    if len(indices) % 3:
        raise invalid("triangles", "must have three indices each", f"{len(indices)} indices")
    positions = document.accessor(attributes["POSITION"], "VEC3", _POSITION)
    return (
        positions_of(positions) if positions.dtype.kind == "i" else positions.astype(np.float32),
        document.accessor(attributes["TEXCOORD_0"], "VEC2", _FLOAT).astype(np.float32),
        indices.astype(np.uint32).reshape(-1, 3),
    )
