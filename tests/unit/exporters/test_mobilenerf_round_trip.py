"""MobileNeRF's layout: what is written comes back, and shows in the layout's viewers what the scene shows."""

import io
import json
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import Image

from core.baked import BakedScene, ShaderNetwork
from core.camera import Camera
from core.conventions import ASSET_FROM_Z_UP
from core.render.reference import render_deferred
from exporters.fallback import mean_colors
from exporters.mobilenerf import Axes, read_mobilenerf, write_mobilenerf
from tests.scenes import look_at_camera, random_network, random_scene
from tests.unit.exporters.equality import as_kept_by_mobilenerf, assert_equal, assert_equal_within_rounding

AXES: list[Axes] = ["z-up", "forward"]


def with_start(scene: BakedScene) -> BakedScene:
    """The scene as a forward-facing one, all of it before its start camera."""
    start = look_at_camera("start", (0.3, -2.5, 0.4), size_px=(64, 48))
    return replace(scene, cameras=(*scene.cameras, start), start_camera=3)


def viewer_color(files: dict[str, bytes], axes: Axes, features: np.ndarray, direction: np.ndarray) -> np.ndarray:
    """What the reference implementation's viewer evaluates for a direction in the OBJ's frame; written after its
    shader: weights [inputs][outputs], and for z-up the inputs d.x, -d.z, d.y."""
    mlp = json.loads(files["mlp.json"])
    x, y, z = direction
    inputs = [*features, *((x, -z, y) if axes == "z-up" else (x, y, z))]
    for layer in range(3):
        outputs = np.array(inputs) @ np.array(mlp[f"{layer}_weights"]) + mlp[f"{layer}_bias"]
        inputs = np.maximum(outputs, 0)
    return 1 / (1 + np.exp(-outputs))


def obj_vertices(data: bytes) -> np.ndarray:
    return np.array([line.split()[1:] for line in data.decode().splitlines() if line.startswith("v ")], float)


def test_z_up_scene_comes_back_exactly_but_for_what_the_layout_lacks(scene: BakedScene) -> None:
    assert_equal(read_mobilenerf(write_mobilenerf(scene, "z-up")), as_kept_by_mobilenerf(scene))


@settings(max_examples=15, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), quads=st.integers(1, 40))
def test_random_scenes_come_back_exactly(seed: int, quads: int) -> None:
    scene = random_scene(np.random.default_rng(seed), quads)
    assert_equal(read_mobilenerf(write_mobilenerf(scene, "z-up")), as_kept_by_mobilenerf(scene))


@pytest.mark.parametrize("axes", AXES)
def test_scene_without_a_start_comes_back_exactly_in_both_conventions(scene: BakedScene, axes: Axes) -> None:
    assert_equal(read_mobilenerf(write_mobilenerf(scene, axes)), as_kept_by_mobilenerf(scene))


@pytest.mark.parametrize("axes", AXES)
def test_texcoords_near_every_border_come_back_exactly(scene: BakedScene, axes: Axes) -> None:
    """v counts from the other end: the smallest ones lose digits where numbers are written with too few."""
    page = scene.pages[0]
    near = np.array([0, 1e-6, 0.5 / 4096, 1.5 / 4096, 1 / 3, 2047.5 / 4096, 1 - 1.5 / 4096, 1], np.float32)
    texcoords = np.resize(np.stack(np.meshgrid(near, near), -1).reshape(-1, 2), page.texcoords.shape)
    bordering = replace(scene, pages=(replace(page, texcoords=texcoords),))
    assert_equal(read_mobilenerf(write_mobilenerf(bordering, axes)), as_kept_by_mobilenerf(bordering))


def test_forward_facing_scene_comes_back_within_rounding(scene: BakedScene) -> None:
    expected = as_kept_by_mobilenerf(with_start(scene))
    actual = read_mobilenerf(write_mobilenerf(expected, "forward"))
    assert_equal_within_rounding(actual, expected)


@pytest.mark.parametrize("axes", AXES)
def test_scene_that_is_read_looks_like_the_one_written(scene: BakedScene, axes: Axes) -> None:
    expected = as_kept_by_mobilenerf(with_start(scene))
    actual = read_mobilenerf(write_mobilenerf(expected, axes))
    for camera in expected.cameras:
        difference = np.abs(render_deferred(actual, camera) - render_deferred(expected, camera)).max(-1)
        assert (difference > 1e-4).mean() < 1e-3  # a rounded vertex may move an edge across a sample


@pytest.mark.parametrize("axes", AXES)
def test_viewers_of_the_layout_see_the_scene_s_colours(scene: BakedScene, axes: Axes, rng: np.random.Generator) -> None:
    original = with_start(scene)
    files = write_mobilenerf(original, axes)
    vertices = obj_vertices(files["shape0.obj"])
    here = original.pages[0].positions.astype(float)
    # The OBJ's frame, found from the vertices alone: p_obj = M (p, 1).
    frame = np.linalg.lstsq(np.c_[here, np.ones(len(here))], vertices, rcond=None)[0].T
    for camera in original.cameras:
        features = rng.uniform(0, 1, 8)
        vertex = rng.integers(len(here))
        eye = frame @ [*camera.position, 1.0]
        direction = vertices[vertex] - eye
        shown = viewer_color(files, axes, features, direction / np.linalg.norm(direction))
        d = here[vertex] - camera.position
        np.testing.assert_allclose(shown, original.network(features, d / np.linalg.norm(d)), atol=1e-5)


def test_z_up_obj_holds_x_z_minus_y(scene: BakedScene) -> None:
    surrounding = replace(scene, start_camera=0)  # written at its own scale
    x, y, z = surrounding.pages[0].positions.astype(float).T
    vertices = obj_vertices(write_mobilenerf(surrounding, "z-up")["shape0.obj"])
    np.testing.assert_allclose(vertices, np.stack([x, z, -y], -1), rtol=1e-8)


def test_object_is_written_for_a_camera_four_units_away(scene: BakedScene) -> None:
    x, y, z = scene.pages[0].positions.astype(float).T
    vertices = obj_vertices(write_mobilenerf(scene, "z-up")["shape0.obj"])
    np.testing.assert_allclose(vertices, 4 * np.stack([x, z, -y], -1), rtol=1e-8)


def test_forward_facing_viewer_stands_at_the_start_camera(scene: BakedScene) -> None:
    original = with_start(scene)
    camera = original.cameras[3]
    vertices = obj_vertices(write_mobilenerf(original, "forward")["shape0.obj"])
    assert (vertices[:, 2] < -0.5).all()  # beyond the viewer's near plane
    offsets = (original.pages[0].positions - camera.position) @ camera.world_from_camera[:3, :3]
    np.testing.assert_allclose(vertices[:, :2] / vertices[:, 2:], offsets[:, :2] / offsets[:, 2:], atol=1e-6)


def test_convention_is_chosen_by_what_the_start_camera_sees(scene: BakedScene) -> None:
    def chosen(candidate: BakedScene) -> str:
        return json.loads(write_mobilenerf(candidate)["mlp.json"])["polyfield"]["axes"]

    within = look_at_camera("within", (0.1, 0.2, 0.1), size_px=(64, 48))
    assert chosen(scene) == "z-up"
    assert chosen(with_start(scene)) == "forward"
    assert chosen(replace(scene, cameras=(within,), start_camera=0)) == "z-up"


def test_alpha_is_stored_in_the_upper_half(scene: BakedScene) -> None:
    files = write_mobilenerf(scene)
    for number, page in enumerate(scene.pages):
        for half in range(2):
            image = np.asarray(Image.open(io.BytesIO(files[f"shape{number}.pngfeat{half}.png"])))
            np.testing.assert_array_equal(image[..., 3], page.features_u8[..., 4 * half + 3] // 2 + 128)
            np.testing.assert_array_equal(image[..., :3], page.features_u8[..., 4 * half : 4 * half + 3])


def test_writing_twice_gives_the_same_bytes(scene: BakedScene) -> None:
    assert write_mobilenerf(scene) == write_mobilenerf(scene)


def test_estimated_colours_match_the_network(rng: np.random.Generator) -> None:
    network = random_network(rng)
    features_u8 = rng.integers(0, 256, (300, 200, 8), dtype=np.uint8)  # more than one block
    directions = np.concatenate([np.eye(3), -np.eye(3)])
    exact = np.mean([network(features_u8 / 255.0, np.broadcast_to(d, (300, 200, 3))) for d in directions], 0)
    expected = np.where(features_u8[..., :1] > 0, np.rint(255 * exact), 0)
    assert np.abs(mean_colors(network, features_u8) - expected).max() <= 1  # float32 at a rounding limit


# Files of others, as the reference implementation writes them: no `polyfield`, six digits, v-vt-f for each quad.
SQUARE = "v 0.000000 0.000000 {z}\nv 1.000000 0.000000 {z}\nv 0.000000 1.000000 {z}\nv 1.000000 1.000000 {z}\n"
TEXTURE = "vt 0.015625 0.984375\nvt 0.015625 0.484375\nvt 0.515625 0.984375\nvt 0.515625 0.484375\n"
FACES = "f 1/1 2/2 4/4\nf 1/1 4/4 3/3\n"


def others_files(network: ShaderNetwork, z: str = "-2.000000", *, split: bool = False) -> dict[str, bytes]:
    image = np.zeros((32, 32, 4), np.uint8)
    image[..., 3] = 128
    image[:17, :17] = (7, 50, 60, 200)
    png = io.BytesIO()
    Image.fromarray(image).save(png, "PNG")
    mlp = {f"{i}_weights": w.T.tolist() for i, w in enumerate(network.weights)}
    mlp |= {f"{i}_bias": b.tolist() for i, b in enumerate(network.biases)} | {"obj_num": 1}
    files = {f"lego_phone/shape0.pngfeat{half}.png": png.getvalue() for half in range(2)}
    text = (SQUARE.format(z=z) + TEXTURE + FACES).encode()
    objs = {"shape0_0.obj": text, "shape0_1.obj": text, "shape0_2.obj": b""} if split else {"shape0.obj": text}
    return files | {
        f"lego_phone/{name}": data for name, data in (objs | {"mlp.json": json.dumps(mlp).encode()}).items()
    }


def test_files_of_others_are_read(rng: np.random.Generator) -> None:
    network = random_network(rng)
    scene = read_mobilenerf(others_files(network), "z-up")
    (page,) = scene.pages
    np.testing.assert_array_equal(page.positions, [[0, 2, 0], [1, 2, 0], [0, 2, 1], [1, 2, 1]])  # (x, z, -y) undone
    np.testing.assert_array_equal(page.texcoords * 64, [[1, 1], [1, 33], [33, 1], [33, 33]])
    np.testing.assert_array_equal(page.triangles, [[0, 1, 3], [0, 3, 2]])
    assert page.features_u8[0, 0].tolist() == [7, 50, 60, 145, 7, 50, 60, 145]
    assert not page.features_u8[17:].any()
    for weight, wanted in zip(scene.network.weights, network.weights, strict=True):
        np.testing.assert_array_equal(weight, wanted)
    np.testing.assert_array_equal(scene.asset_from_object, ASSET_FROM_Z_UP)
    assert (scene.background, scene.cameras) == ((1.0, 1.0, 1.0), ())


def test_forward_facing_files_of_others_start_at_their_origin(rng: np.random.Generator) -> None:
    scene = read_mobilenerf(others_files(random_network(rng)))
    np.testing.assert_array_equal(scene.pages[0].positions[3], [1, 1, -2])
    np.testing.assert_array_equal(scene.asset_from_object, np.eye(4))
    assert scene.start_camera == 0
    start: Camera = scene.cameras[0]
    np.testing.assert_array_equal(start.world_from_camera, np.eye(4))
    assert 2 * np.degrees(np.arctan(start.size_px[1] / 2 / start.focal_px[1])) == pytest.approx(50, abs=0.01)


def test_axes_of_others_are_guessed_from_where_the_scene_lies(rng: np.random.Generator) -> None:
    network = random_network(rng)
    behind_too = read_mobilenerf(others_files(network, z="0.500000"))
    np.testing.assert_array_equal(behind_too.asset_from_object, ASSET_FROM_Z_UP)


def test_split_shapes_are_joined(rng: np.random.Generator) -> None:
    scene = read_mobilenerf(others_files(random_network(rng), split=True))
    assert scene.triangle_count == 4
    assert scene.pages[0].triangles.max() == 7


def test_corners_that_pair_other_texture_coordinates_become_vertices_of_their_own(rng: np.random.Generator) -> None:
    files = others_files(random_network(rng))
    files["lego_phone/shape0.obj"] += b"f 1/2 2/1 3/3\n"
    (page,) = read_mobilenerf(files, "z-up").pages
    a, b, c = page.triangles[2]
    np.testing.assert_array_equal(page.positions[[a, b, c]], [[0, 2, 0], [1, 2, 0], [0, 2, 1]])
    np.testing.assert_array_equal(page.texcoords[[a, b, c]] * 64, [[1, 33], [1, 1], [33, 1]])
