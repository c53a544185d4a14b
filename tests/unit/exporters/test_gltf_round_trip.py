"""What is written comes back bit for bit."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from core.baked import BakedScene
from core.errors import SceneInvalid
from exporters.glsl import VERSIONS, shader_sources
from exporters.gltf import read_glb, read_shaders, write_glb
from exporters.gltf.extension import NAME
from tests.scenes import random_network, random_scene
from tests.unit.exporters.equality import assert_equal
from tests.unit.exporters.glb import split


def test_scene_comes_back_bit_for_bit(scene: BakedScene) -> None:
    assert_equal(read_glb(write_glb(scene)["scene.glb"]), scene)


@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), quads=st.integers(1, 60))
def test_random_scenes_come_back_bit_for_bit(seed: int, quads: int) -> None:
    scene = random_scene(np.random.default_rng(seed), quads)
    assert_equal(read_glb(write_glb(scene)["scene.glb"]), scene)


def test_writing_twice_gives_the_same_bytes(scene: BakedScene) -> None:
    assert write_glb(scene) == write_glb(scene)


def test_network_of_extreme_numbers_comes_back(scene: BakedScene, rng: np.random.Generator) -> None:
    network = random_network(rng)
    numbers = network.weights[0].copy()
    numbers.flat[:5] = [np.finfo(np.float32).max, np.finfo(np.float32).tiny, 1e-45, -0.0, 16777217]
    extreme = replace(network, weights=(numbers, *network.weights[1:]))
    assert_equal(read_glb(write_glb(replace(scene, network=extreme))["scene.glb"]), replace(scene, network=extreme))


@pytest.mark.parametrize("name", ["", "Büste – vorn", 'a "quoted" name', "r_0"])
def test_camera_names_come_back(scene: BakedScene, name: str) -> None:
    named = replace(scene, cameras=(replace(scene.cameras[0], name=name),))
    assert read_glb(write_glb(named)["scene.glb"]).cameras[0].name == name


def test_loosely_rigid_pose_comes_back_exactly(scene: BakedScene) -> None:
    pose = scene.cameras[0].world_from_camera.copy()
    pose[:3, :3] *= 1.0002  # within a camera's tolerance, outside glTF's
    loose = replace(scene, cameras=(replace(scene.cameras[0], world_from_camera=pose),))
    assert_equal(read_glb(write_glb(loose)["scene.glb"]), loose)


def test_many_vertices_come_back_with_32_bit_indices(scene: BakedScene) -> None:
    page = scene.pages[0]
    copies = 600
    many = replace(
        page,
        positions=np.tile(page.positions, (copies, 1)),
        texcoords=np.tile(page.texcoords, (copies, 1)),
        triangles=page.triangles + np.uint32((copies - 1) * len(page.positions)),
    )
    large = replace(scene, pages=(many,))
    glb = write_glb(large)["scene.glb"]
    assert split(glb)[0]["accessors"][2]["componentType"] == 5125
    assert_equal(read_glb(glb), large)


def test_stored_shaders_are_those_of_the_network(scene: BakedScene) -> None:
    shaders = read_shaders(write_glb(scene)["scene.glb"])
    assert shaders == {dialect: shader_sources(scene.network, dialect) for dialect in VERSIONS}


def test_extension_is_used_but_never_required(scene: BakedScene) -> None:
    document, _ = split(write_glb(scene)["scene.glb"])
    assert set(document["extensionsUsed"]) == {NAME, "KHR_materials_unlit"}
    assert "extensionsRequired" not in document


def test_fallback_is_unlit_masked_and_double_sided(scene: BakedScene) -> None:
    document, _ = split(write_glb(scene)["scene.glb"])
    for material in document["materials"]:
        assert material["extensions"] == {"KHR_materials_unlit": {}}
        assert (material["alphaMode"], material["alphaCutoff"], material["doubleSided"]) == ("MASK", 0.5, True)
    assert document["samplers"] == [{"magFilter": 9728, "minFilter": 9728, "wrapS": 33071, "wrapT": 33071}]


def test_cameras_are_children_of_the_object(scene: BakedScene) -> None:
    document, _ = split(write_glb(scene)["scene.glb"])
    (root,) = document["scenes"][0]["nodes"]
    cameras = [index for index, node in enumerate(document["nodes"]) if "camera" in node]
    assert len(cameras) == len(scene.cameras)
    assert set(cameras) < set(document["nodes"][root]["children"])


def test_gltf_camera_has_the_photo_s_field_of_view(scene: BakedScene) -> None:
    document, _ = split(write_glb(scene)["scene.glb"])
    for camera, written in zip(scene.cameras, document["cameras"], strict=True):
        perspective = written["perspective"]
        tangent = np.tan(perspective["yfov"] / 2)
        assert camera.size_px[1] / 2 / camera.focal_px[1] == pytest.approx(tangent, rel=1e-12)
        assert camera.size_px[0] / 2 / camera.focal_px[0] == pytest.approx(
            tangent * perspective["aspectRatio"], rel=1e-12
        )


def test_sheared_object_transform_is_refused(scene: BakedScene) -> None:
    sheared = np.eye(4)
    sheared[0, 1] = 0.1
    with pytest.raises(SceneInvalid, match="asset_from_object"):
        write_glb(replace(scene, asset_from_object=sheared))
