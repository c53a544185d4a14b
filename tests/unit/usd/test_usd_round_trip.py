"""USD: what is written comes back, and says what it should to those who know nothing of Polyfield."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pxr import Gf, Usd, UsdGeom, UsdShade

from core.baked import BakedScene, Page
from core.errors import AssetInvalid
from exporters.usd import read_usd, write_usd
from exporters.usd.layers import stage_of
from exporters.usd.mesh import upside_down
from exporters.usd.writer import Form
from tests.scenes import random_network, random_scene
from tests.unit.exporters.equality import assert_equal

FORMS: tuple[Form, ...] = ("usdc", "usda", "usdz")


def written_stage(scene: BakedScene) -> Usd.Stage:
    return stage_of("scene.usdc", write_usd(scene)["scene.usdc"])


def similarity(scale: float, translation: tuple[float, float, float]) -> np.ndarray:
    turn = np.array([[0.36, 0.48, -0.8], [-0.8, 0.6, 0.0], [0.48, 0.64, 0.6]])
    matrix = np.eye(4)
    matrix[:3, :3] = scale * turn
    matrix[:3, 3] = translation
    return matrix


@pytest.mark.parametrize("form", FORMS)
def test_scene_comes_back_exactly(scene: BakedScene, form: Form) -> None:
    assert_equal(read_usd(write_usd(scene, form)), scene)


@settings(max_examples=5, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), quads=st.integers(1, 40))
def test_random_scenes_come_back_exactly(seed: int, quads: int) -> None:
    scene = random_scene(np.random.default_rng(seed), quads)
    assert_equal(read_usd(write_usd(scene)), scene)


@pytest.mark.parametrize("form", FORMS)
def test_writing_twice_gives_the_same_bytes(scene: BakedScene, form: Form) -> None:
    assert write_usd(scene, form) == write_usd(scene, form)


@pytest.mark.parametrize("scale", [2.5, 1e-6, 1e6])
@pytest.mark.parametrize("form", FORMS)
def test_both_frames_and_the_start_come_back_exactly(scene: BakedScene, form: Form, scale: float) -> None:
    placed = replace(
        scene,
        asset_from_object=similarity(scale, (1e6, -3.0, 0.1)),
        user_from_object=similarity(1 / scale, (0.1, 0.2, -7e5)),
        start_camera=1,
    )
    read = read_usd(write_usd(placed, form))
    assert_equal(read, placed)
    assert np.array_equal(read.user_from_object, placed.user_from_object)
    assert read.start_camera == 1


@pytest.mark.parametrize("form", FORMS)
def test_network_of_extreme_numbers_comes_back(scene: BakedScene, rng: np.random.Generator, form: Form) -> None:
    network = random_network(rng)
    numbers = network.weights[0].copy()
    numbers.flat[:5] = [np.finfo(np.float32).max, np.finfo(np.float32).tiny, 1e-45, -0.0, 16777217]
    extreme = replace(scene, network=replace(network, weights=(numbers, *network.weights[1:])))
    assert_equal(read_usd(write_usd(extreme, form)), extreme)


@pytest.mark.parametrize("name", ["", "Büste – vorn", 'a "quoted" name', "r_0"])
def test_any_name_of_a_photo_comes_back(scene: BakedScene, name: str) -> None:
    named = replace(scene, cameras=(replace(scene.cameras[0], name=name),))
    assert read_usd(write_usd(named, "usda")).cameras[0].name == name


def test_many_pages_keep_their_order(scene: BakedScene) -> None:
    many = replace(scene, pages=tuple(scene.pages[number % 2] for number in range(12)))
    assert_equal(read_usd(write_usd(many)), many)


def test_stage_is_y_up_and_in_metres_with_one_root(scene: BakedScene) -> None:
    stage = written_stage(scene)
    assert UsdGeom.GetStageUpAxis(stage) == UsdGeom.Tokens.y
    assert UsdGeom.GetStageMetersPerUnit(stage) == 1.0
    assert [prim.GetName() for prim in stage.GetPseudoRoot().GetChildren()] == ["scene"]
    assert stage.GetDefaultPrim().GetName() == "scene"


def test_bounds_in_the_world_are_those_of_the_asset(scene: BakedScene) -> None:
    stage = written_stage(scene)
    box = UsdGeom.BBoxCache(Usd.TimeCode.Default(), ["default"]).ComputeWorldBound(stage.GetDefaultPrim())
    points = np.concatenate([page.positions for page in scene.pages]) @ scene.asset_from_object[:3, :3].T
    found = box.ComputeAlignedRange()
    np.testing.assert_allclose([found.GetMin(), found.GetMax()], [points.min(0), points.max(0)], atol=1e-6)  # float32


def test_camera_of_usd_sees_what_the_camera_sees(scene: BakedScene) -> None:
    stage = written_stage(replace(scene, asset_from_object=similarity(3.0, (1.0, 2.0, 3.0))))
    for number, camera in enumerate(scene.cameras):
        seen_by = UsdGeom.Camera(stage.GetPrimAtPath(f"/scene/view{number}")).GetCamera(Usd.TimeCode.Default())
        project = seen_by.frustum.ComputeViewMatrix() * seen_by.frustum.ComputeProjectionMatrix()
        point_object = np.array([0.1, -0.2, 0.15])
        point_asset = similarity(3.0, (1.0, 2.0, 3.0)) @ np.append(point_object, 1.0)
        ndc = project.Transform(Gf.Vec3d(*point_asset[:3]))
        at_camera = np.linalg.inv(camera.world_from_camera) @ np.append(point_object, 1.0)
        x = camera.centre_px[0] - camera.focal_px[0] * at_camera[0] / at_camera[2]
        y = camera.centre_px[1] + camera.focal_px[1] * at_camera[1] / at_camera[2]
        width, height = camera.size_px
        # USD's lenses are float32.
        np.testing.assert_allclose(ndc[:2], [2 * x / width - 1, 1 - 2 * y / height], atol=1e-5)


def test_textures_are_upright_and_st_starts_at_the_bottom(scene: BakedScene) -> None:
    stage = written_stage(scene)
    mesh = UsdGeom.Mesh(stage.GetPrimAtPath("/scene/page0"))
    st_values = np.array(UsdGeom.PrimvarsAPI(mesh).GetPrimvar("st").Get())
    np.testing.assert_array_equal(st_values[:, 1], 1 - scene.pages[0].texcoords[:, 1])


@given(st.lists(st.integers(0, 2**24), min_size=1))
def test_texture_coordinates_that_are_multiples_of_2_to_the_minus_24_come_back(numerators: list[int]) -> None:
    texcoords = np.repeat(np.array(numerators, np.float32)[:, None] / np.float32(2**24), 2, 1)
    assert np.array_equal(upside_down(upside_down(texcoords)), texcoords)


def test_weights_are_stored_once_however_many_pages(scene: BakedScene) -> None:
    layer = written_stage(scene).GetRootLayer().ExportToString()
    assert layer.count("polyfield:network:weights1 =") == 1
    assert layer.count("info:glslfx:sourceCode =") == 1


def test_features_are_raw_and_colours_are_srgb(scene: BakedScene) -> None:
    stage = written_stage(scene)
    spaces = {"features0": "raw", "features1": "raw", "color": "sRGB"}
    for name, space in spaces.items():
        texture = UsdShade.Shader(stage.GetPrimAtPath(f"/scene/materials/page1/{name}"))
        assert texture.GetInput("sourceColorSpace").Get() == space
        assert texture.GetInput("file").Get().path == f"./page1.{name}.png"
    for name in ("features0", "features1"):
        image = UsdShade.Shader(stage.GetPrimAtPath(f"/scene/materials/page1/network/{name}"))
        assert image.GetInput("file").GetAttr().GetColorSpace() == "raw"


def test_every_page_has_a_surface_for_each_kind_of_renderer(scene: BakedScene) -> None:
    stage = written_stage(scene)
    for number in range(len(scene.pages)):
        mesh = stage.GetPrimAtPath(f"/scene/page{number}")
        material = UsdShade.MaterialBindingAPI(mesh).ComputeBoundMaterial()[0]
        kinds = ("", "glslfx", "mtlx")
        names = [material.ComputeSurfaceSource(kind)[0].GetPrim().GetName() for kind in kinds]
        assert names == ["preview", "storm", "materialx"]


@pytest.mark.parametrize(
    ("right", "wrong", "says"),
    [
        ('"relu", "relu", "sigmoid"', '"relu", "relu", "tanh"', "activations"),
        ("faceVertexCounts = [3, 3,", "faceVertexCounts = [4, 2,", "triangles"),
        ("float[] polyfield:network:weights2", "float[] polyfield:network:weights7", "schema"),
        ("./page0.color.png", "./page1.color.png", "one size"),
        ("./page0.color.png", "../../secret.png", "among the files"),
        ('prepend apiSchemas = ["PolyfieldSceneAPI"]', "", "PolyfieldSceneAPI"),
        ("texCoord2f[] primvars:st", "texCoord2f[] primvars:uv", "primvar st"),
        ("point3f[] points", "point3f[] dots", "schema"),
        ("rel material:binding", "rel material:bonding", "materials"),
    ],
)
def test_fault_is_named(scene: BakedScene, right: str, wrong: str, says: str) -> None:
    files = write_usd(scene, "usda")
    text = files["scene.usda"].decode()
    assert right in text
    with pytest.raises(AssetInvalid, match=says):
        read_usd({**files, "scene.usda": text.replace(right, wrong).encode()})


def test_missing_texture_is_named(scene: BakedScene) -> None:
    files = write_usd(scene)
    del files["page1.features1.png"]
    with pytest.raises(AssetInvalid, match=r"page1\.features1\.png"):
        read_usd(files)


def test_reference_to_another_layer_is_refused(scene: BakedScene) -> None:
    files = write_usd(scene, "usda")
    text = files["scene.usda"].decode().replace("#usda 1.0\n(", "#usda 1.0\n(\n    subLayers = [@other.usda@]", 1)
    with pytest.raises(AssetInvalid, match="other layers"):
        read_usd({**files, "scene.usda": text.encode()})


@pytest.mark.parametrize("name", ["scene.usda", "scene.usdc", "scene.usdz"])
def test_something_else_is_refused(name: str) -> None:
    with pytest.raises(AssetInvalid):
        read_usd({name: b"something else"})


def test_no_layer_is_refused(scene: BakedScene) -> None:
    with pytest.raises(AssetInvalid, match=r"\.usdc or \.usda"):
        read_usd({"page0.color.png": b""})


def test_page_without_alpha_agreement_is_refused(scene: BakedScene) -> None:
    page: Page = scene.pages[0]
    holes = replace(page, features_u8=np.where(page.features_u8 > 0, page.features_u8, np.uint8(1)))
    files = write_usd(scene)
    other = write_usd(replace(scene, pages=(holes, *scene.pages[1:])))
    with pytest.raises(AssetInvalid, match="holes"):
        read_usd({**files, "page0.color.png": other["page0.color.png"]})
