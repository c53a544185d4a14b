"""USD written by `write_usd`, back as the baked scene."""

import io
import zipfile
from collections.abc import Mapping

import numpy as np
from pxr import Sdf, Usd, UsdGeom, UsdShade

from core.baked import LAYER_SHAPES, BakedScene, Page, ShaderNetwork
from core.conventions import is_opaque
from core.errors import AssetInvalid
from exporters.invalid import invalid, only_asset_invalid
from exporters.limits import check_size
from exporters.png import decode_pngs, png_size
from exporters.usd import schema
from exporters.usd.cameras import camera_of
from exporters.usd.layers import stage_of
from exporters.usd.matrices import from_usd
from exporters.usd.mesh import mesh_of
from exporters.usd.writer import TEXTURES

_LAYERS = (".usdc", ".usda")


def read_usd(files: Mapping[str, bytes]) -> BakedScene:
    """The scene in what `write_usd` wrote, by name; texture coordinates as `mesh.mesh_of` says, all else bit for bit.

    Not for files of unknown origin: OpenUSD's reader of .usdc trusts them.

    Raises:
        AssetInvalid: damaged, or not a scene of this kind.
    """
    with only_asset_invalid("USD"):
        files = _unpacked(files)
        names = [name for name in files if name.endswith(_LAYERS)]
        if len(names) != 1:
            raise invalid("files", "must have one .usdc or .usda", f"{len(names)}")
        return _scene(stage_of(names[0], files[names[0]]), files)


def _unpacked(files: Mapping[str, bytes]) -> Mapping[str, bytes]:
    """What is in the .usdz, if there is one."""
    packages = [name for name in files if name.endswith(".usdz")]
    if not packages:
        return files
    try:
        with zipfile.ZipFile(io.BytesIO(files[packages[0]])) as package:
            stored = [entry for entry in package.infolist() if entry.compress_type == zipfile.ZIP_STORED]
            return {entry.filename: package.read(entry) for entry in stored}
    except zipfile.BadZipFile as error:
        raise invalid(packages[0], "must be a .usdz", str(error)) from error


def _scene(stage: Usd.Stage, files: Mapping[str, bytes]) -> BakedScene:
    root = stage.GetDefaultPrim()
    if not root or schema.SCENE_API not in root.GetPrimTypeInfo().GetAppliedAPISchemas():
        raise invalid("USD stage", f"must have a default prim with {schema.SCENE_API}", "none")
    meshes = [UsdGeom.Mesh(prim) for prim in root.GetChildren() if prim.IsA(UsdGeom.Mesh)]
    materials = [UsdShade.MaterialBindingAPI(mesh).ComputeBoundMaterial()[0] for mesh in meshes]
    if not meshes or not all(materials):
        raise invalid("USD stage", "must have meshes with materials", f"{len(meshes)} meshes")
    views = [prim for prim in root.GetChildren() if prim.IsA(UsdGeom.Camera)]
    red, green, blue = root.GetAttribute(schema.BACKGROUND).Get()
    return BakedScene(
        pages=_pages(meshes, materials, files),
        network=_network(materials[0].GetPrim()),
        background=(red, green, blue),
        asset_from_object=from_usd(UsdGeom.Xformable(root).GetLocalTransformation()),
        cameras=tuple(camera_of(prim) for prim in views),
        user_from_object=from_usd(root.GetAttribute(schema.USER_FROM_OBJECT).Get()),
        start_camera=_start(root, [prim.GetPath() for prim in views]),
    )


def _pages(
    meshes: list[UsdGeom.Mesh], materials: list[UsdShade.Material], files: Mapping[str, bytes]
) -> tuple[Page, ...]:
    pngs = [[_texture(material, name, files) for name in TEXTURES] for material in materials]
    sizes = [{png_size(png, "page's texture") for png in page} for page in pngs]
    if any(len(size) != 1 for size in sizes):
        raise invalid("page's textures", "must have one size", str(sizes)[:80])
    check_size([size.pop() for size in sizes], AssetInvalid)
    return tuple(_page(mesh, page) for mesh, page in zip(meshes, pngs, strict=True))


def _page(mesh: UsdGeom.Mesh, pngs: list[bytes]) -> Page:
    features0, features1, color = decode_pngs(pngs, "page's texture")
    features_u8 = np.concatenate([features0, features1], -1)
    if not np.array_equal(color[..., 3] > 0, is_opaque(features_u8)):
        raise invalid("page's textures", "must agree on where holes are", "a fallback with other holes")
    return Page(features_u8, np.ascontiguousarray(color[..., :3]), *mesh_of(mesh))


def _texture(material: UsdShade.Material, name: str, files: Mapping[str, bytes]) -> bytes:
    """The file of a material's texture node."""
    node = UsdShade.Shader.Get(material.GetPrim().GetStage(), material.GetPath().AppendChild(name))
    asset: Sdf.AssetPath = node.GetInput("file").Get()
    file = asset.path.removeprefix("./")
    if file not in files:
        raise invalid(file[:80], "must be among the files given", "a reference to another file")
    return files[file]


def _network(prim: Usd.Prim) -> ShaderNetwork:
    activations = tuple(prim.GetAttribute(schema.ACTIVATIONS).Get() or ())
    if activations != schema.RELU_RELU_SIGMOID or prim.GetAttribute(schema.CODING).Get() != schema.UNORM8:
        rule = f"must have activations {schema.RELU_RELU_SIGMOID} and coding {schema.UNORM8}"
        raise invalid("network", rule, str(activations)[:80])
    w0, w1, w2 = (
        np.array(prim.GetAttribute(name).Get(), np.float32).reshape(shape)
        for name, shape in zip(schema.WEIGHTS, LAYER_SHAPES, strict=True)
    )
    b0, b1, b2 = (np.array(prim.GetAttribute(name).Get(), np.float32) for name in schema.BIASES)
    return ShaderNetwork((w0, w1, w2), (b0, b1, b2))


def _start(root: Usd.Prim, views: list[Sdf.Path]) -> int | None:
    targets = root.GetRelationship(schema.START_VIEW).GetTargets() if root.HasRelationship(schema.START_VIEW) else []
    return views.index(targets[0]) if targets else None
