"""The compressed files hold the compacted scene."""

from dataclasses import replace

import numpy as np
import pytest

from core.baked import BakedScene
from core.conventions import is_opaque
from exporters.check import check_glb
from exporters.compaction import PHONE, WEB, compacted
from exporters.glsl import VERSIONS, shader_sources
from exporters.gltf import compressed, read_glb, read_shaders, write_glb, write_lq_glb, write_web_glb
from exporters.gltf.compressed import TRIED_TEXELS, in_order_of_use
from exporters.gltf.quantization import LARGEST, quantised, steps_of
from tests.scenes import random_scene
from tests.unit.compaction.lookups import Lookups, random_points
from tests.unit.exporters.glb import split

WRITERS = {"web": (write_web_glb, WEB), "lq": (write_lq_glb, PHONE)}
POINTS = random_points(30)


@pytest.fixture
def wide(scene: BakedScene) -> BakedScene:
    """The scene with a quad so far away that whole steps cannot hold both."""
    page = scene.pages[0]
    positions = page.positions.copy()
    positions[:4] = positions[:4] + np.float32(1e4)
    return replace(scene, pages=(replace(page, positions=positions), *scene.pages[1:]))


@pytest.mark.parametrize("kind", WRITERS)
@pytest.mark.parametrize("tried", [TRIED_TEXELS, 0], ids=["small", "large"])
def test_what_is_read_is_the_compacted_scene(
    scene: BakedScene, kind: str, tried: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(compressed, "TRIED_TEXELS", tried)
    write, quality = WRITERS[kind]
    ((name, glb),) = write(scene).items()
    held, expected = read_glb(glb), quantised(compacted(scene, quality))
    assert name == f"scene.{kind}.glb"
    assert expected is not None
    for page, other in zip(held.pages, map(in_order_of_use, expected.pages), strict=True):
        np.testing.assert_array_equal(page.features_u8, other.features_u8)
        opaque = is_opaque(page.features_u8)
        np.testing.assert_array_equal(page.colors_u8[opaque], other.colors_u8[opaque])
        np.testing.assert_array_equal(page.positions, other.positions)
        np.testing.assert_array_equal(page.texcoords, other.texcoords)
        # The codec may start a triangle at another of its corners.
        np.testing.assert_array_equal(np.sort(page.triangles, 1), np.sort(other.triangles, 1))
    assert [w.tolist() for w in held.network.weights] == [w.tolist() for w in expected.network.weights]
    np.testing.assert_allclose(held.asset_from_object, expected.asset_from_object, atol=1e-12)
    assert [c.world_from_camera.tolist() for c in held.cameras] == [
        c.world_from_camera.tolist() for c in expected.cameras
    ]


def test_too_wide_a_scene_keeps_float_positions(wide: BakedScene) -> None:
    assert quantised(wide) is None
    glb = write_web_glb(wide)["scene.web.glb"]
    held = read_glb(glb)
    assert "KHR_mesh_quantization" not in split(glb)[0]["extensionsRequired"]
    before, after = (np.concatenate([page.positions for page in each.pages]) for each in (wide, held))
    for positions in (before, after):
        positions.sort(0)
    np.testing.assert_allclose(after, before, rtol=2**-15, atol=2**-15)
    np.testing.assert_array_equal(held.asset_from_object, wide.asset_from_object)


@pytest.mark.parametrize("kind", WRITERS)
def test_equal_positions_stay_equal(scene: BakedScene, wide: BakedScene, kind: str) -> None:
    # So that seams stay closed: as many different places as before, not more.
    write, quality = WRITERS[kind]
    for each in (scene, wide):
        (glb,) = write(each).values()
        places = [
            len(np.unique(np.concatenate([page.positions for page in s.pages]), axis=0))
            for s in (compacted(each, quality), read_glb(glb))
        ]
        assert places[1] <= places[0]


def test_positions_are_within_half_a_step(scene: BakedScene) -> None:
    rounded = quantised(scene)
    assert rounded is not None
    object_from_new = np.linalg.inv(scene.asset_from_object) @ rounded.asset_from_object
    for page, other in zip(scene.pages, rounded.pages, strict=True):
        back = other.positions.astype(np.float64) @ object_from_new[:3, :3].T + object_from_new[:3, 3]
        assert np.abs(back - page.positions).max() <= 0.51 * object_from_new[0, 0] / LARGEST
        assert np.abs(steps_of(other.positions)).max() <= LARGEST


def test_frames_and_cameras_follow_the_positions(scene: BakedScene) -> None:
    placed = replace(scene, user_from_object=np.diag([3.0, 3.0, 3.0, 1.0]))
    rounded = quantised(placed)
    assert rounded is not None
    for before, after in zip(placed.cameras, rounded.cameras, strict=True):
        for frame in ("asset_from_object", "user_from_object"):
            here, there = getattr(placed, frame), getattr(rounded, frame)
            np.testing.assert_allclose(
                there[:3, :3] @ after.position + there[:3, 3], here[:3, :3] @ before.position + here[:3, 3], atol=1e-12
            )
        np.testing.assert_array_equal(after.world_from_camera[:3, :3], before.world_from_camera[:3, :3])


def test_texture_coordinates_are_exact(scene: BakedScene) -> None:
    held = read_glb(write_web_glb(scene)["scene.web.glb"])
    for page in held.pages:
        height, width = page.features_u8.shape[:2]
        centres = page.texcoords.astype(np.float64) * (width, height) - 0.5
        np.testing.assert_array_equal(centres, np.rint(centres))


def test_shaders_are_those_of_the_changed_network(scene: BakedScene) -> None:
    glb = write_web_glb(scene)["scene.web.glb"]
    network = read_glb(glb).network
    assert read_shaders(glb) == {dialect: shader_sources(network, dialect) for dialect in VERSIONS}


def test_loaders_are_told_what_they_need(scene: BakedScene) -> None:
    document, _ = split(write_web_glb(scene)["scene.web.glb"])
    assert set(document["extensionsRequired"]) <= set(document["extensionsUsed"])
    assert {"EXT_meshopt_compression", "KHR_mesh_quantization"} <= set(document["extensionsRequired"])
    assert document["buffers"][1]["extensions"] == {"EXT_meshopt_compression": {"fallback": True}}
    assert "uri" not in document["buffers"][1]


def test_nothing_is_wrong_with_them(scene: BakedScene, wide: BakedScene) -> None:
    for each in (scene, wide, random_scene(np.random.default_rng(8))):
        for write, _ in WRITERS.values():
            (glb,) = write(each).values()
            assert [finding.severity for finding in check_glb(glb)] == ["note"]


def test_they_are_smaller(scene: BakedScene) -> None:
    plain, web, lq = (len(next(iter(write(scene).values()))) for write in (write_glb, write_web_glb, write_lq_glb))
    json = 60_000  # the same in all: network and shader text
    assert web - json < 0.6 * (plain - json)
    assert lq - json < 0.4 * (web - json)


def test_writing_twice_gives_the_same_bytes(scene: BakedScene) -> None:
    assert write_web_glb(scene) == write_web_glb(scene)


def test_lookups_survive_the_renumbering(scene: BakedScene) -> None:
    renumbered = replace(scene, pages=tuple(in_order_of_use(page) for page in scene.pages))
    np.testing.assert_array_equal(*Lookups(scene, POINTS).paired(Lookups(renumbered, POINTS)))
