"""Khronos' glTF validator finds no error and no warning."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from core.baked import BakedScene
from exporters.gltf import Provenance, read_glb, write_glb, write_gltf, write_lq_glb, write_web_glb
from tests.conformance.gltf_validation import assert_clean, validated, validated_file
from tests.scenes import random_scene


def test_validator_finds_nothing_in_a_scene_with_pages_and_cameras(scene: BakedScene, tmp_path: Path) -> None:
    report = validated(write_glb(scene)["scene.glb"], tmp_path)
    assert_clean(report)
    assert report["info"]["totalTriangleCount"] == scene.triangle_count
    assert report["info"]["maxUVs"] == 1


def test_validator_finds_nothing_in_the_gltf_with_files(scene: BakedScene, tmp_path: Path) -> None:
    for name, data in write_gltf(scene).items():
        (tmp_path / name).write_bytes(data)
    report = validated_file(tmp_path / "scene.gltf")
    assert_clean(report)
    assert len(report["info"]["resources"]) == 1 + 3 * len(scene.pages)


@pytest.mark.parametrize("write", [write_glb, write_web_glb, write_lq_glb])
def test_validator_finds_nothing_in_any_variant_with_provenance(
    scene: BakedScene, write: Callable[..., dict[str, bytes]], tmp_path: Path
) -> None:
    (glb,) = write(scene, Provenance(title="a title", creator="someone", settings={"preset": "draft"})).values()
    report = validated(glb, tmp_path)
    assert_clean(report)
    assert report["info"]["totalTriangleCount"] == read_glb(glb).triangle_count


@pytest.mark.parametrize("scale", [1.0, 2.5, 1e-6, 1e6])
@pytest.mark.parametrize("translation", [0.0, 1e6], ids=["here", "far away"])
def test_validator_finds_nothing_wherever_the_object_is(scale: float, translation: float, tmp_path: Path) -> None:
    q, _ = np.linalg.qr(np.random.default_rng(4).normal(size=(3, 3)))
    placed = np.eye(4)
    placed[:3, :3] = scale * np.sign(np.linalg.det(q)) * q
    placed[:3, 3] = scale * translation
    scene = replace(
        random_scene(np.random.default_rng(1)), asset_from_object=placed, user_from_object=placed, start_camera=0
    )
    assert_clean(validated(write_glb(scene)["scene.glb"], tmp_path))


def test_validator_finds_nothing_in_an_object_that_is_not_placed(tmp_path: Path) -> None:
    scene = replace(random_scene(np.random.default_rng(1)), asset_from_object=np.eye(4), cameras=())
    assert_clean(validated(write_glb(scene)["scene.glb"], tmp_path))


def test_validator_finds_nothing_with_32_bit_indices(tmp_path: Path) -> None:
    scene = _with_many_vertices(random_scene(np.random.default_rng(2)), 70_000)
    assert_clean(validated(write_glb(scene)["scene.glb"], tmp_path))


def _with_many_vertices(scene: BakedScene, count: int) -> BakedScene:
    """The scene with its page's vertices repeated, and triangles that use the last copy."""
    (page,) = scene.pages
    copies = -(-count // len(page.positions))
    return replace(
        scene,
        pages=(
            replace(
                page,
                positions=np.tile(page.positions, (copies, 1)),
                texcoords=np.tile(page.texcoords, (copies, 1)),
                triangles=page.triangles + np.uint32((copies - 1) * len(page.positions)),
            ),
        ),
    )
