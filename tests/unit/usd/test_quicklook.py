"""The asset for phones: within their limits, and each of its steps."""

import io
import zipfile
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import Image
from pxr import Usd, UsdGeom, UsdShade

from core.baked import BakedScene
from core.conventions import is_opaque
from core.errors import SceneInvalid
from exporters.usd.layers import stage_of
from exporters.usd.mesh import mesh_of
from exporters.usd.quicklook import write_quicklook
from exporters.usd.quicklook.decimation import clustered, decimated
from exporters.usd.quicklook.quilt import SMALLEST_PATCH_PX, Quilt, quilt
from exporters.usd.quicklook.texels import texels_of
from tests.scenes import random_scene


def parts(package: bytes) -> dict[str, bytes]:
    with zipfile.ZipFile(io.BytesIO(package)) as opened:
        return {name: opened.read(name) for name in opened.namelist()}


def read(scene: BakedScene, **limits: int) -> tuple[Usd.Stage, np.ndarray]:
    """Stage and texture of what is written."""
    files = parts(write_quicklook(scene, **limits)["scene.quicklook.usdz"])
    return stage_of("scene.usdc", files["scene.usdc"]), np.array(Image.open(io.BytesIO(files["color.png"])))


def sphere(rows: int, columns: int) -> tuple[np.ndarray, np.ndarray]:
    """Vertices and triangles of a unit sphere, each triangle with vertices of its own."""
    i, j = np.meshgrid(np.linspace(0, np.pi, rows + 1), np.linspace(0, 2 * np.pi, columns + 1), indexing="ij")
    grid = np.stack([np.sin(i) * np.cos(j), np.sin(i) * np.sin(j), np.cos(i)], -1).round(6)
    corners = np.stack([grid[:-1, :-1], grid[:-1, 1:], grid[1:, 1:], grid[1:, :-1]], 2).reshape(-1, 4, 3)
    positions = corners[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3).astype(np.float32)
    return positions, np.arange(len(positions)).reshape(-1, 3)


def random_triangles(seed: int, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Triangles on a few random vertices: edges with any number of them."""
    rng = np.random.default_rng(seed)
    triangles = np.array([rng.choice(count + 3, 3, replace=False) for _ in range(count)])
    return rng.normal(size=(count + 3, 3)).astype(np.float32), np.unique(np.sort(triangles, 1), axis=0)


# The file


def test_package_is_stored_aligned_and_starts_with_the_layer(scene: BakedScene) -> None:
    data = write_quicklook(scene)["scene.quicklook.usdz"]
    with zipfile.ZipFile(io.BytesIO(data)) as opened:
        assert [entry.filename for entry in opened.infolist()] == ["scene.usdc", "color.png"]
        for entry in opened.infolist():
            assert entry.compress_type == zipfile.ZIP_STORED
            name_length, extra_length = np.frombuffer(data, "<u2", 2, entry.header_offset + 26)
            assert (entry.header_offset + 30 + int(name_length) + int(extra_length)) % 64 == 0


def test_writing_twice_gives_the_same_bytes(scene: BakedScene) -> None:
    assert write_quicklook(scene, texture_px=128) == write_quicklook(scene, texture_px=128)


def test_stage_is_upright_in_metres_and_stands_on_the_floor(scene: BakedScene) -> None:
    scaled = replace(scene, asset_from_object=np.diag([3.0, 3.0, 3.0, 1.0]) @ scene.asset_from_object)
    stage, _ = read(scaled, texture_px=128)
    assert UsdGeom.GetStageUpAxis(stage) == UsdGeom.Tokens.y
    assert UsdGeom.GetStageMetersPerUnit(stage) == 1.0
    box = UsdGeom.BBoxCache(Usd.TimeCode.Default(), ["default"]).ComputeWorldBound(stage.GetDefaultPrim())
    found = box.ComputeAlignedRange()
    low, high = scene.bounds()
    np.testing.assert_allclose(np.array(found.GetSize()), 3 * (high - low)[[0, 2, 1]], rtol=1e-5)  # float32
    assert found.GetMin()[1] == pytest.approx(0, abs=1e-5)
    np.testing.assert_allclose(np.array(found.GetMidpoint())[[0, 2]], 0, atol=1e-5)


def test_material_is_a_masked_preview_surface_that_only_emits(scene: BakedScene) -> None:
    stage, _ = read(scene, texture_px=128)
    mesh = stage.GetPrimAtPath("/scene/mesh")
    surface = UsdShade.MaterialBindingAPI(mesh).ComputeBoundMaterial()[0].ComputeSurfaceSource()[0]
    assert surface.GetIdAttr().Get() == "UsdPreviewSurface"
    assert surface.GetInput("opacityThreshold").Get() == 0.5
    assert tuple(surface.GetInput("diffuseColor").Get()) == (0, 0, 0)
    assert UsdGeom.Mesh(mesh).GetDoubleSidedAttr().Get()


def test_limits_hold(scene: BakedScene) -> None:
    stage, image = read(scene, most_triangles=20, texture_px=64)
    assert image.shape == (64, 64, 4)
    assert 10 < len(mesh_of(UsdGeom.Mesh(stage.GetPrimAtPath("/scene/mesh")))[2]) <= 20


def test_scene_without_an_opaque_texel_is_refused(scene: BakedScene) -> None:
    empty = replace(scene, pages=tuple(replace(p, features_u8=np.zeros_like(p.features_u8)) for p in scene.pages))
    with pytest.raises(SceneInvalid, match="opaque"):
        write_quicklook(empty)


def test_scene_of_points_is_refused(scene: BakedScene) -> None:
    points = tuple(replace(page, positions=np.zeros_like(page.positions)) for page in scene.pages)
    with pytest.raises(SceneInvalid, match="area"):
        write_quicklook(replace(scene, pages=points))


def test_pages_without_an_opaque_texel_do_not_matter(scene: BakedScene) -> None:
    first, second = scene.pages
    hollow = replace(scene, pages=(first, replace(second, features_u8=np.zeros_like(second.features_u8))))
    assert write_quicklook(hollow, texture_px=128) == write_quicklook(replace(scene, pages=(first,)), texture_px=128)


def test_texture_shows_the_texel_at_every_place(scene: BakedScene) -> None:
    """Each of the asset's opaque texels has the colour of a scene's texel no further away than half a texel."""
    stage, image = read(scene, texture_px=512)
    positions, texcoords, triangles = mesh_of(UsdGeom.Mesh(stage.GetPrimAtPath("/scene/mesh")))
    texels, _ = texels_of(scene)
    for triangle in triangles[::7]:
        centre = positions[triangle].mean(0)
        column, row = np.floor(texcoords[triangle].mean(0) * 512).astype(int)
        distance = np.linalg.norm(texels.positions - centre, axis=1)
        near = distance < distance.min() + 0.02  # a texel's diagonal in this scene
        if image[row, column, 3] == 255:
            assert (texels.colors_u8[near & texels.opaque] == image[row, column, :3]).all(-1).any()
        else:
            assert not texels.opaque[near].all()


# Its steps


def test_texels_of_a_patch_are_all_found_in_their_places(scene: BakedScene) -> None:
    texels, shown = texels_of(scene)
    page = scene.pages[0]
    height, width = page.features_u8.shape[:2]
    corner = page.texcoords[page.triangles[0, 0]] * (width, height) - 0.5  # a texel's centre
    column, row = np.rint(corner).astype(int)
    at = np.flatnonzero((texels.positions == page.positions[page.triangles[0, 0]]).all(1))
    assert len(at) >= 1
    assert (texels.colors_u8[at] == page.colors_u8[row, column]).all(1).any()
    opaque = sum(int(is_opaque(page.features_u8).sum()) for page in scene.pages)
    diagonals = 9 * sum(len(page.triangles) // 2 for page in scene.pages)  # texels on two triangles count twice
    assert opaque <= texels.opaque.sum() <= opaque + diagonals
    assert all(visible.all() for visible in shown)


def test_large_scenes_are_thinned_evenly(scene: BakedScene) -> None:
    everything, _ = texels_of(scene)
    some, _ = texels_of(scene, most=len(everything.positions) // 3)
    assert len(everything.positions) / 6 < len(some.positions) < len(everything.positions) / 2.5
    known = {tuple(p) for p in everything.positions}
    assert all(tuple(p) in known for p in some.positions)


def test_sphere_stays_a_sphere() -> None:
    positions, triangles = sphere(40, 80)
    fewer, kept = decimated(positions, triangles, 1000)
    assert 800 < len(kept) <= 1000
    radius = np.linalg.norm(fewer[kept].mean(1), axis=-1)
    assert radius.min() > 0.95
    assert radius.max() < 1.02


def test_few_triangles_are_left_alone() -> None:
    positions, triangles = sphere(6, 8)
    same, kept = decimated(positions, triangles, 1000)
    area = np.linalg.norm(np.cross(*(positions[triangles[:, k]] - positions[triangles[:, 0]] for k in (1, 2))), axis=1)
    assert len(kept) == (area > 0).sum()
    assert {tuple(p) for p in same} == {tuple(p) for p in positions}


@settings(max_examples=30, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), count=st.integers(4, 60), most=st.integers(1, 20))
def test_any_heap_of_triangles_can_be_decimated(seed: int, count: int, most: int) -> None:
    positions, triangles = random_triangles(seed, count)
    fewer, kept = decimated(positions, triangles, most)
    assert len(kept) <= most
    assert np.isfinite(fewer).all()


def test_clustering_moves_vertices_less_than_a_cell() -> None:
    positions, triangles = sphere(20, 40)
    fewer, kept = clustered(positions, triangles, 0.2)
    assert len(kept) < len(triangles)
    assert (np.abs(np.linalg.norm(fewer, axis=1) - 1) < 0.2).all()


def assert_patches_are_apart(patches: Quilt) -> None:
    covered = np.zeros((patches.size_px, patches.size_px), int)
    for (left, top), side in zip(patches.left_top_px, patches.patch_px, strict=True):
        assert min(left, top) >= 0
        assert max(left, top) + side <= patches.size_px
        covered[top : top + side, left : left + side] += 1
    assert covered.max() == 1


@settings(max_examples=30, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), count=st.integers(1, 60))
def test_any_heap_of_triangles_gets_patches_that_are_apart(seed: int, count: int) -> None:
    positions, triangles = random_triangles(seed, count)
    patches = quilt(positions, triangles, 64)
    assert_patches_are_apart(patches)
    assert patches.patch_px.min() >= SMALLEST_PATCH_PX
    corners = patches.corners.ravel()[patches.triangles()]
    found = {tuple(sorted(t)) for t in corners.tolist()}
    assert found == {tuple(t) for t in triangles.tolist()}
    assert len(corners) == len(triangles)


def test_quads_get_one_patch_each_and_the_texture_is_used() -> None:
    positions, triangles = sphere(20, 40)
    _, place = np.unique(positions, axis=0, return_inverse=True)
    positions, triangles = np.unique(positions, axis=0), place.ravel()[triangles]
    triangles = triangles[[len(set(t)) == 3 for t in triangles.tolist()]]
    patches = quilt(positions, triangles, 256)
    assert (patches.corners[:, 3] >= 0).mean() > 0.9
    assert (patches.patch_px**2).sum() > 0.6 * 256**2


def test_places_of_texels_agree_with_texture_coordinates() -> None:
    positions, triangles = random_triangles(3, 12)
    patches = quilt(positions, triangles, 64)
    texels, places = patches.places(positions)
    assert len({tuple(t) for t in texels}) == len(texels) == (patches.patch_px**2).sum()
    corners = patches.corners.ravel()
    texcoords = patches.texcoords().reshape(-1, 2)
    at = {tuple(t): place for t, place in zip(texels, places, strict=True)}
    for triangle in patches.triangles().ravel():
        texel = tuple(np.floor(texcoords[triangle] * 64).astype(int))
        np.testing.assert_allclose(at[texel], positions[corners[triangle]], atol=1e-6)


def test_random_scene_is_written(rng: np.random.Generator) -> None:
    stage, _ = read(random_scene(rng), texture_px=256)
    assert len(mesh_of(UsdGeom.Mesh(stage.GetPrimAtPath("/scene/mesh")))[2]) > 0
