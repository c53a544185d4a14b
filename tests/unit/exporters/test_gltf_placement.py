"""Frames survive the file: similarities of any size, as translation, rotation and scale."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from core.baked import BakedScene
from core.conventions import ASSET_FROM_Z_UP
from core.errors import AssetInvalid, SceneInvalid
from exporters.gltf import read_glb, write_glb
from exporters.gltf.extension import NAME
from exporters.gltf.placement import node_matrix, trs
from tests.unit.exporters.glb import join, split

# A quaternion's products round a few times: some units in the last place.
ROUNDING = 16 * np.finfo(np.float64).eps
SCALES = [1e-6, 1.0, 0.1, 3.7, 1e6]
AXIS_ROTATIONS = [
    matrix for p in ([0, 1, 2], [1, 2, 0], [2, 0, 1], [0, 2, 1], [2, 1, 0], [1, 0, 2])
    for signs in np.ndindex(2, 2, 2)
    if np.linalg.det(matrix := np.eye(3)[p] * (1.0 - 2.0 * np.array(signs))) > 0
]  # fmt: skip


def similarity(rotation: np.ndarray, scale: float, translation: Any) -> np.ndarray:
    matrix = np.eye(4)
    matrix[:3, :3] = scale * rotation
    matrix[:3, 3] = translation
    return matrix


def random_rotation(seed: int) -> np.ndarray:
    q, _ = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))
    return q * np.sign(np.linalg.det(q))


@pytest.mark.parametrize("scale", SCALES)
def test_quarter_turns_come_back_exactly_at_any_scale(scale: float) -> None:
    assert len(AXIS_ROTATIONS) == 24
    for rotation in AXIS_ROTATIONS:
        matrix = similarity(rotation, scale, (1e6 * scale, -0.1, 1 / 3))
        assert np.array_equal(node_matrix(trs(matrix), "node"), matrix)


@given(
    seed=st.integers(0, 2**32 - 1),
    exponent=st.floats(-9, 9),
    translation=st.tuples(*[st.floats(-1e12, 1e12)] * 3),
)
def test_any_similarity_comes_back_within_rounding(
    seed: int, exponent: float, translation: tuple[float, float, float]
) -> None:
    matrix = similarity(random_rotation(seed), 10.0**exponent, translation)
    back = node_matrix(trs(matrix), "node")
    np.testing.assert_allclose(back[:3, :3], matrix[:3, :3], rtol=0, atol=ROUNDING * 10.0**exponent)
    assert np.array_equal(back[:, 3], matrix[:, 3])


@pytest.mark.parametrize("axis", [*np.eye(3).tolist(), [0.6, 0.8, 0.0], [0.0, -0.6, 0.8]])
def test_half_turns_come_back(axis: list[float]) -> None:
    # The real part of the quaternion is zero: the case that simple formulas divide by.
    half_turn = 2 * np.outer(axis, axis) - np.eye(3)
    back = node_matrix(trs(similarity(half_turn, 2.5, (0, 0, 0))), "node")
    np.testing.assert_allclose(back[:3, :3], 2.5 * half_turn, rtol=0, atol=2.5 * ROUNDING)


@pytest.mark.parametrize("scale", SCALES)
def test_frames_of_a_scene_come_back_exactly(scene: BakedScene, scale: float) -> None:
    user = similarity(random_rotation(3), scale, (1e6 * scale, 2 * scale, -1e6 * scale))
    asset = ASSET_FROM_Z_UP @ similarity(np.eye(3), scale, user[:3, 3])
    placed = replace(scene, user_from_object=user, asset_from_object=asset)
    back = read_glb(write_glb(placed)["scene.glb"])
    assert np.array_equal(back.user_from_object, user)
    assert np.array_equal(back.asset_from_object, asset)
    # What is in the object frame has not moved by a bit.
    assert np.array_equal(back.pages[0].positions, scene.pages[0].positions)
    assert np.array_equal(back.cameras[0].world_from_camera, scene.cameras[0].world_from_camera)


def test_identity_frames_are_not_written(scene: BakedScene) -> None:
    document, _ = split(write_glb(replace(scene, asset_from_object=np.eye(4)))["scene.glb"])
    assert "userFromObject" not in document["extensions"][NAME]
    assert not {"translation", "rotation", "scale", "matrix"} & set(document["nodes"][0])


def test_file_without_the_users_frame_is_in_it(scene: BakedScene) -> None:
    assert np.array_equal(read_glb(write_glb(scene)["scene.glb"]).user_from_object, np.eye(4))


@pytest.mark.parametrize("scale", SCALES)
def test_camera_nodes_are_rigid_in_the_asset(scene: BakedScene, scale: float) -> None:
    asset = ASSET_FROM_Z_UP @ similarity(random_rotation(5), scale, np.full(3, 100 * scale))
    document, _ = split(write_glb(replace(scene, asset_from_object=asset))["scene.glb"])
    nodes = document["nodes"]
    placed = [node_matrix(nodes[0], "node") @ node_matrix(node, "node") for node in nodes if "camera" in node]
    for matrix, camera in zip(placed, scene.cameras, strict=True):
        expected = asset @ camera.world_from_camera
        np.testing.assert_allclose(matrix[:3, :3], expected[:3, :3] / scale, rtol=0, atol=1e-9)  # poses as given
        np.testing.assert_allclose(matrix[:3, 3], expected[:3, 3], rtol=1e-12)


@pytest.mark.parametrize("scale", SCALES)
def test_near_plane_scales_with_the_object(scene: BakedScene, scale: float) -> None:
    def near(asset_from_object: np.ndarray) -> float:
        document, _ = split(write_glb(replace(scene, asset_from_object=asset_from_object))["scene.glb"])
        return document["cameras"][0]["perspective"]["znear"]

    assert near(similarity(np.eye(3), scale, (0, 0, 0))) == pytest.approx(scale * near(np.eye(4)))


def test_matrix_of_another_writer_is_read(scene: BakedScene) -> None:
    document, binary = split(write_glb(scene)["scene.glb"])
    placed = similarity(random_rotation(9), 2.5, (3, 4, 5))
    for name in ("translation", "rotation", "scale"):
        document["nodes"][0].pop(name, None)
    document["nodes"][0]["matrix"] = placed.T.ravel().tolist()
    assert np.array_equal(read_glb(join(document, binary)).asset_from_object, placed)


@pytest.mark.parametrize(
    "wrong",
    [
        {"scale": [1, 2, 1]},
        {"scale": [0, 0, 0]},
        {"scale": [-1, -1, -1]},
        {"scale": [1e-30] * 3},
        {"rotation": [0, 0, 0, 0]},
        {"rotation": [0, 0, 1]},
        {"translation": [1e400, 0, 0]},
        {"translation": ["1", 0, 0]},
        {"translation": None},
        {"matrix": [1.0] * 16},
    ],
    ids=str,
)
def test_wrong_place_of_the_object_is_refused(scene: BakedScene, wrong: dict[str, Any]) -> None:
    document, binary = split(write_glb(scene)["scene.glb"])
    document["nodes"][0].update(wrong)
    with pytest.raises(AssetInvalid):
        read_glb(join(document, binary))


@pytest.mark.parametrize("wrong", [[1.0] * 16, [0.0] * 16, [1.0], None, "x", [1e400] * 16], ids=str)
def test_wrong_users_frame_is_refused(scene: BakedScene, wrong: Any) -> None:
    document, binary = split(write_glb(scene)["scene.glb"])
    document["extensions"][NAME]["userFromObject"] = wrong
    with pytest.raises(AssetInvalid):
        read_glb(join(document, binary))


MIRROR = np.diag([1.0, 1.0, -1.0, 1.0])
SHEAR = np.eye(4) + 0.1 * np.eye(4, k=1)
PROJECTION = np.eye(4) + np.eye(4, k=-3)


@pytest.mark.parametrize("name", ["asset_from_object", "user_from_object"])
@pytest.mark.parametrize("wrong", [MIRROR, SHEAR, PROJECTION, np.zeros((4, 4)), np.full((4, 4), np.nan), np.eye(3)])
def test_scene_refuses_frames_that_are_not_similar(scene: BakedScene, name: str, wrong: np.ndarray) -> None:
    with pytest.raises(SceneInvalid, match=name):
        replace(scene, **{name: wrong})


def test_start_camera_comes_back(scene: BakedScene) -> None:
    for start in (None, 0, 2):
        back = read_glb(write_glb(replace(scene, start_camera=start))["scene.glb"])
        assert back.start_camera == start


@pytest.mark.parametrize("wrong", [-1, 3, True, 0.0, "0", []], ids=str)
def test_start_camera_that_is_none_of_the_cameras_is_refused(scene: BakedScene, wrong: Any) -> None:
    with pytest.raises(SceneInvalid, match="start_camera"):
        replace(scene, start_camera=wrong)
    document, binary = split(write_glb(scene)["scene.glb"])
    document["extensions"][NAME]["startView"] = wrong
    with pytest.raises(AssetInvalid):
        read_glb(join(document, binary))
