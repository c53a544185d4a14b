"""A scene for AR Quick Look: one mesh, one texture of the mean colours, within what phones take."""

import numpy as np
from scipy.spatial import cKDTree

from core.baked import BakedScene
from core.errors import SceneInvalid
from exporters.limits import check_size
from exporters.png import encode_png
from exporters.usd.layers import layer_bytes, package_bytes
from exporters.usd.material import add_preview_material
from exporters.usd.mesh import add_mesh
from exporters.usd.quicklook.decimation import decimated
from exporters.usd.quicklook.quilt import Quilt, quilt
from exporters.usd.quicklook.texels import Texels, texels_of
from exporters.usd.writer import ROOT, new_stage

FILE_NAME = "scene.quicklook.usdz"
MOST_TRIANGLES = 100_000  # Apple's advice for AR Quick Look
TEXTURE_PX = 2048
TEXTURE_NAME = "color.png"


def write_quicklook(
    scene: BakedScene, most_triangles: int = MOST_TRIANGLES, texture_px: int = TEXTURE_PX
) -> dict[str, bytes]:
    """`{"scene.quicklook.usdz": ...}`: the fallback alone, which stands upright on the floor, in metres where known.

    The bottom of the scene's box is at y = 0, its middle above the origin; otherwise the frame is the asset's.

    Raises:
        SceneInvalid: the pages exceed what a reader accepts, or there is nothing to see.
    """
    check_size([page.features_u8.shape[:2] for page in scene.pages], SceneInvalid)
    texels, shown = texels_of(scene)
    if not texels.opaque.any():
        raise SceneInvalid("scene", "must have an opaque texel", "holes only")
    patches, positions = _patches(scene, shown, most_triangles, texture_px)
    image = _image(patches, positions, texels)
    corners = np.where(patches.corners >= 0, patches.corners, patches.corners[:, :1]).ravel()
    vertices = positions[corners]
    stage, _ = new_stage(_standing(scene.asset_from_object, vertices))
    material = add_preview_material(ROOT.AppendChild("material"), stage, f"./{TEXTURE_NAME}")
    mesh = (vertices, patches.texcoords().reshape(-1, 2).astype(np.float32), patches.triangles())
    add_mesh(stage, ROOT.AppendChild("mesh"), mesh, material)
    layer = layer_bytes(stage, "usdc")
    return {FILE_NAME: package_bytes({"scene.usdc": layer, TEXTURE_NAME: encode_png(image)})}


def _patches(
    scene: BakedScene, shown: list[np.ndarray], most_triangles: int, texture_px: int
) -> tuple[Quilt, np.ndarray]:
    """Patches of the triangles that show anything, and the vertices [V, 3] that they index."""
    first = np.cumsum([0, *(len(page.positions) for page in scene.pages)])
    triangles = [
        page.triangles[visible].astype(np.int64) + offset
        for page, visible, offset in zip(scene.pages, shown, first[:-1], strict=True)
    ]
    everything = np.concatenate([page.positions for page in scene.pages])
    positions, kept = decimated(everything, np.concatenate(triangles), most_triangles)
    if not len(kept):
        raise SceneInvalid("scene", "must have triangles with an area", "points and lines")
    return quilt(positions, kept, texture_px), positions


def _image(patches: Quilt, positions: np.ndarray, texels: Texels) -> np.ndarray:
    """uint8 [h, w, 4]: of each texel the nearest one of the scene. Holes have the colour of what is next to them."""
    image = np.zeros((patches.size_px, patches.size_px, 4), np.uint8)
    at, places = patches.places(positions)
    nearest = _nearest(texels.positions, places)
    opaque = texels.opaque[nearest]
    solid = np.flatnonzero(texels.opaque)
    nearest[~opaque] = solid[_nearest(texels.positions[solid], places[~opaque])]
    image[at[:, 1], at[:, 0], :3] = texels.colors_u8[nearest]
    image[at[:, 1], at[:, 0], 3] = np.where(opaque, np.uint8(255), np.uint8(0))
    return image


def _nearest(points: np.ndarray, places: np.ndarray) -> np.ndarray:
    """[m] int64: the nearest of points [n, 3] to each of places [m, 3]."""
    tree = cKDTree(points, balanced_tree=False, compact_nodes=False)
    found: np.ndarray = tree.query(places, workers=-1)[1]
    return found


def _standing(asset_from_object: np.ndarray, vertices: np.ndarray) -> np.ndarray:
    """[4, 4]: the asset's frame, moved so that vertices [V, 3] (object frame) stand on the floor at the origin."""
    placed = vertices.astype(np.float64) @ asset_from_object[:3, :3].T
    low, high = placed.min(0), placed.max(0)
    matrix = asset_from_object.copy()
    matrix[:3, 3] = -np.array([(low[0] + high[0]) / 2, low[1], (low[2] + high[2]) / 2])
    return matrix
