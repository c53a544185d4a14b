"""A baked scene as USD: layer and textures, or all of it in one .usdz."""

from typing import Literal

import numpy as np
from pxr import Gf, Kind, Sdf, Usd, UsdGeom

from core.baked import BakedScene, Page, similarity_scale
from core.conventions import is_opaque
from core.errors import SceneInvalid
from exporters.limits import check_size
from exporters.png import encode_pngs
from exporters.usd import schema
from exporters.usd.cameras import add_camera
from exporters.usd.layers import layer_bytes, package_bytes
from exporters.usd.material import COLOR_TEXTURE, add_material_class, add_page_material
from exporters.usd.materialx_graph import FEATURE_IMAGES
from exporters.usd.matrices import to_usd
from exporters.usd.mesh import add_mesh

Form = Literal["usdc", "usda", "usdz"]

NAME = "scene"
ROOT = Sdf.Path(f"/{NAME}")
MATERIALS = ROOT.AppendChild("materials")
TEXTURES = (*FEATURE_IMAGES, COLOR_TEXTURE)


def write_usd(scene: BakedScene, form: Form = "usdc") -> dict[str, bytes]:
    """The whole scene; `read_usd` returns it bit for bit (texture coordinates: as `mesh.mesh_of` says).

    The frame is glTF's (+y up), in metres where the capture knew them. docs/usd/README.md says what is where.

    Args:
        form: "usdc": `scene.usdc`, binary, and three PNGs a page; "usda": the same as readable text; "usdz":
            `scene.usdz`, one file of it all.

    Raises:
        SceneInvalid: the pages exceed what a reader accepts.
    """
    check_size([page.features_u8.shape[:2] for page in scene.pages], SceneInvalid)
    names = [f"page{number}.{texture}.png" for number in range(len(scene.pages)) for texture in TEXTURES]
    pngs = encode_pngs([image for page in scene.pages for image in _page_images(page)])
    textures = dict(zip(names, pngs, strict=True))
    stage = _stage(scene)
    if form == "usdz":
        return {f"{NAME}.usdz": package_bytes({f"{NAME}.usdc": layer_bytes(stage, "usdc"), **textures})}
    return {f"{NAME}.{form}": layer_bytes(stage, form), **textures}


def new_stage(asset_from_object: np.ndarray) -> tuple[Usd.Stage, Usd.Prim]:
    """A stage in memory and its root prim: the object, placed in glTF's frame, in metres."""
    stage = Usd.Stage.CreateInMemory()
    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.y)
    UsdGeom.SetStageMetersPerUnit(stage, UsdGeom.LinearUnits.meters)
    root = UsdGeom.Xform.Define(stage, ROOT)
    root.AddTransformOp().Set(to_usd(asset_from_object))
    Usd.ModelAPI(root).SetKind(Kind.Tokens.component)
    stage.SetDefaultPrim(root.GetPrim())
    return stage, root.GetPrim()


def _stage(scene: BakedScene) -> Usd.Stage:
    stage, root = new_stage(scene.asset_from_object)
    materials = UsdGeom.Scope.Define(stage, MATERIALS).GetPrim()
    add_material_class(materials, scene.network)
    for number, page in enumerate(scene.pages):
        name = f"page{number}"
        files = {texture: f"./{name}.{texture}.png" for texture in TEXTURES}
        height, width = page.features_u8.shape[:2]
        material = add_page_material(materials, name, files, (height, width))
        add_mesh(stage, ROOT.AppendChild(name), (page.positions, page.texcoords, page.triangles), material)
    _add_cameras(stage, scene)
    _write_scene(root, scene)
    return stage


def _page_images(page: Page) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The RGBA images of TEXTURES; the fallback's alpha is 0 in holes, 255 elsewhere."""
    alpha = np.where(is_opaque(page.features_u8), np.uint8(255), np.uint8(0))[..., None]
    return page.features_u8[..., :4], page.features_u8[..., 4:], np.concatenate([page.colors_u8, alpha], -1)


def _add_cameras(stage: Usd.Stage, scene: BakedScene) -> None:
    lowest, highest = scene.bounds()
    scale, diagonal = similarity_scale(scene.asset_from_object), float(np.linalg.norm(highest - lowest))
    for number, camera in enumerate(scene.cameras):
        add_camera(stage, _view(number), camera, scale, diagonal)


def _view(number: int) -> Sdf.Path:
    return ROOT.AppendChild(f"view{number}")


def _write_scene(root: Usd.Prim, scene: BakedScene) -> None:
    """What is known of the scene as a whole."""
    root.AddAppliedSchema(schema.SCENE_API)
    uniform = Sdf.VariabilityUniform
    background = root.CreateAttribute(schema.BACKGROUND, Sdf.ValueTypeNames.Double3, False, uniform)
    background.Set(Gf.Vec3d(*(float(c) for c in scene.background)))
    user = root.CreateAttribute(schema.USER_FROM_OBJECT, Sdf.ValueTypeNames.Matrix4d, False, uniform)
    user.Set(to_usd(scene.user_from_object))
    if scene.start_camera is not None:
        root.CreateRelationship(schema.START_VIEW, False).SetTargets([_view(scene.start_camera)])
