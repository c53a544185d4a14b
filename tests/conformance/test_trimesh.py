"""trimesh, which does not know the extension, loads the file with its fallback."""

import io

import numpy as np
import trimesh

from core.baked import BakedScene
from exporters.gltf import write_glb


def test_trimesh_loads_mesh_texture_and_transform(scene: BakedScene) -> None:
    loaded = trimesh.load(io.BytesIO(write_glb(scene)["scene.glb"]), file_type="glb", force="scene")
    assert len(loaded.geometry) == len(scene.pages)
    assert sum(len(mesh.faces) for mesh in loaded.geometry.values()) == scene.triangle_count
    low, high = scene.bounds()
    corners = np.array([[x, y, z, 1] for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2])])
    placed = corners @ scene.asset_from_object.T
    np.testing.assert_allclose(loaded.bounds, [placed.min(0)[:3], placed.max(0)[:3]], atol=1e-6)  # float32 vertices


def test_trimesh_sees_the_mean_colours_and_the_mask(scene: BakedScene) -> None:
    loaded = trimesh.load(io.BytesIO(write_glb(scene)["scene.glb"]), file_type="glb", force="scene")
    material = loaded.geometry["page0"].visual.material
    texture = np.asarray(material.baseColorTexture)
    page = scene.pages[0]
    np.testing.assert_array_equal(texture[..., :3], page.colors_u8)
    np.testing.assert_array_equal(texture[..., 3] == 255, page.features_u8[..., 0] > 0)
    assert (material.alphaMode, material.doubleSided) == ("MASK", True)
