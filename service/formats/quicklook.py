"""A .usdz for AR Quick Look, as a viewer reads it."""

import io
import zipfile

import numpy as np
from PIL import Image
from pxr import UsdGeom

from core.errors import AssetInvalid
from exporters.usd.layers import stage_of
from exporters.usd.matrices import from_usd
from exporters.usd.mesh import mesh_of
from service.formats.colours import Coloured, scene_of_colours


def read_quicklook(package: bytes) -> Coloured:
    """The one mesh and its texture; `asset_from_object` stands on the floor.

    Raises:
        AssetInvalid
    """
    try:
        with zipfile.ZipFile(io.BytesIO(package)) as opened:
            layer, image = opened.namelist()
            stage = stage_of(layer, opened.read(layer))
            rgba_u8 = np.asarray(Image.open(io.BytesIO(opened.read(image))).convert("RGBA"))
    except (zipfile.BadZipFile, ValueError, OSError) as error:
        raise AssetInvalid("scene.quicklook.usdz", "must be a layer and a texture", str(error)[:120]) from error
    root = stage.GetDefaultPrim()
    (mesh,) = [UsdGeom.Mesh(prim) for prim in root.GetChildren() if prim.IsA(UsdGeom.Mesh)]
    place = from_usd(UsdGeom.Xformable(root).GetLocalTransformation())
    return Coloured(scene_of_colours([(rgba_u8, *mesh_of(mesh))], place), "object")
