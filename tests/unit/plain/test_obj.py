"""trimesh, which reads OBJ as other tools do, finds the scene's triangles, textures and place in it."""

import io
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import trimesh
from PIL import Image

from core.baked import BakedScene
from core.conventions import ASSET_FROM_Z_UP, is_opaque
from exporters.mobilenerf.obj import parse_obj
from exporters.plain import write_obj
from exporters.png import decode_png

SEVEN_DIGITS = 1e-6  # of numbers of order 1


def loaded(files: dict[str, bytes], folder: Path) -> trimesh.Scene:
    for name, data in files.items():
        (folder / name).write_bytes(data)
    return trimesh.load(folder / "scene.obj", force="scene", process=False)


@pytest.fixture(scope="module")
def placed(scene: BakedScene) -> BakedScene:
    """Moved, and twice as large in the asset."""
    matrix = np.diag([2.0, 2.0, 2.0, 1.0]) @ ASSET_FROM_Z_UP
    matrix[:3, 3] = (10.0, 0.5, -3.0)
    return replace(scene, asset_from_object=matrix)


@pytest.fixture(scope="module")
def files(placed: BakedScene) -> dict[str, bytes]:
    return write_obj(placed)


def in_asset(scene: BakedScene, page: int) -> np.ndarray:
    return scene.pages[page].positions @ scene.asset_from_object[:3, :3].T + scene.asset_from_object[:3, 3]


def test_files_name_each_other(files: dict[str, bytes]) -> None:
    assert set(files) == {
        "scene.obj", "scene.mtl",
        "scene.page0.png", "scene.page0.mask.png", "scene.page1.png", "scene.page1.mask.png",
    }  # fmt: skip
    assert b"mtllib scene.mtl\n" in files["scene.obj"]
    for name in ("scene.page0.png", "scene.page1.mask.png"):
        assert name.encode() in files["scene.mtl"]


def test_triangles_have_their_corners_and_texture_coordinates(placed: BakedScene, files: dict[str, bytes]) -> None:
    texts = files["scene.obj"].split(b"o scene.page")[1:]
    assert len(texts) == len(placed.pages)
    positions, texcoords, triangles = parse_obj([files["scene.obj"]], "scene.obj")
    first = 0
    for number, page in enumerate(placed.pages):
        these = triangles[first : first + len(page.triangles)]
        np.testing.assert_allclose(positions[these], in_asset(placed, number)[page.triangles], atol=10 * SEVEN_DIGITS)
        np.testing.assert_allclose(texcoords[these], page.texcoords[page.triangles], atol=SEVEN_DIGITS)
        first += len(these)
    assert first == len(triangles)


def test_corners_at_one_place_are_one_vertex(placed: BakedScene, files: dict[str, bytes]) -> None:
    expected = sum(len(np.unique(page.positions, axis=0)) for page in placed.pages)
    assert files["scene.obj"].count(b"\nv ") == expected
    assert files["scene.obj"].count(b"\nvt ") == sum(len(page.positions) for page in placed.pages)


def test_trimesh_finds_every_triangle_upright_and_at_scale(
    placed: BakedScene, files: dict[str, bytes], tmp_path: Path
) -> None:
    found = loaded(files, tmp_path)
    assert sum(len(mesh.faces) for mesh in found.geometry.values()) == placed.triangle_count
    everything = np.concatenate([in_asset(placed, number) for number in range(len(placed.pages))])
    np.testing.assert_allclose(found.bounds, [everything.min(0), everything.max(0)], atol=10 * SEVEN_DIGITS)


def test_trimesh_finds_the_colours(placed: BakedScene, files: dict[str, bytes], tmp_path: Path) -> None:
    meshes = {mesh.visual.material.name: mesh for mesh in loaded(files, tmp_path).geometry.values()}
    for number, page in enumerate(placed.pages):
        texture = np.asarray(meshes[f"scene.page{number}"].visual.material.image)
        opaque = is_opaque(page.features_u8)
        np.testing.assert_array_equal(texture[opaque][:, :3], page.colors_u8[opaque])
        np.testing.assert_array_equal(texture[..., 3] == 255, opaque)


def test_mask_is_the_same_in_every_channel(placed: BakedScene, files: dict[str, bytes]) -> None:
    for number, page in enumerate(placed.pages):
        mask = decode_png(files[f"scene.page{number}.mask.png"], "mask")
        expected = np.where(is_opaque(page.features_u8), 255, 0)
        np.testing.assert_array_equal(mask, np.repeat(expected[..., None], 4, -1))


def test_holes_have_the_colour_of_a_texel_beside_them(placed: BakedScene, files: dict[str, bytes]) -> None:
    colors = decode_png(files["scene.page0.png"], "colours")
    page = placed.pages[0]
    opaque = is_opaque(page.features_u8)
    row, column = next((r, c) for r, c in np.argwhere(~opaque) if c > 0 and opaque[r, c - 1])
    np.testing.assert_array_equal(colors[row, column, :3], page.colors_u8[row, column - 1])
    assert (colors[~opaque][:, :3] > 0).any(-1).mean() > 0.9


def test_pictures_are_plain_rgba(files: dict[str, bytes]) -> None:
    assert {Image.open(io.BytesIO(data)).mode for name, data in files.items() if name.endswith(".png")} == {"RGBA"}
