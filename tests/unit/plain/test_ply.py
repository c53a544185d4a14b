"""PLY: the mesh with colours at its vertices, as trimesh reads it."""

import io
from dataclasses import replace

import numpy as np
import pytest
import trimesh

from core.baked import BakedScene, Page
from core.conventions import ASSET_FROM_Z_UP
from core.errors import SceneInvalid
from exporters.plain import write_ply


def loaded(files: dict[str, bytes]) -> trimesh.Trimesh:
    return trimesh.load(io.BytesIO(files["scene.ply"]), file_type="ply", process=False)


def square(colors_u8: np.ndarray, opaque: np.ndarray, network: BakedScene) -> BakedScene:
    """A unit square in the x-y plane (object frame) that shows a picture [8, 8, 3]."""
    features = np.where(opaque[..., None], np.uint8(200), np.uint8(0)) * np.ones(8, np.uint8)
    corners = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], np.float32)
    page = Page(
        features.astype(np.uint8),
        colors_u8,
        np.pad(corners, ((0, 0), (0, 1))),
        corners,
        np.array([[0, 1, 2], [0, 2, 3]], np.uint32),
    )
    return replace(network, pages=(page,), asset_from_object=np.eye(4))


WHOLE = np.ones((8, 8), bool)
GREY = np.full((8, 8, 3), 90, np.uint8)


def test_trimesh_finds_what_the_header_states_upright_and_at_scale(scene: BakedScene) -> None:
    placed = replace(scene, asset_from_object=np.diag([3.0, 3.0, 3.0, 1.0]) @ ASSET_FROM_Z_UP)
    files = write_ply(placed)
    header = files["scene.ply"].partition(b"end_header")[0].decode()
    found = loaded(files)
    assert f"element vertex {len(found.vertices)}\n" in header
    assert f"element face {len(found.faces)}\n" in header
    low, high = scene.bounds()  # (x, y, z) -> (x, z, -y)
    expected = 3 * np.array([[low[0], low[2], -high[1]], [high[0], high[2], -low[1]]])
    # Pieces at the border may be holes; they are an eighth of a quad's side or so, and quads 0.3 wide.
    np.testing.assert_allclose(found.bounds, expected, atol=0.3)


def test_evenly_coloured_square_is_whole_and_of_that_colour(scene: BakedScene) -> None:
    found = loaded(write_ply(square(GREY, WHOLE, scene)))
    assert len(found.faces) == 2 * 8 * 8
    assert len(found.vertices) == 9 * 9  # one vertex a place
    assert found.area == pytest.approx(1.0)
    assert found.is_winding_consistent
    np.testing.assert_array_equal(found.visual.vertex_colors, np.tile([90, 90, 90, 255], (81, 1)))


def test_colours_are_where_the_texture_has_them(scene: BakedScene) -> None:
    colors = np.zeros((8, 8, 3), np.uint8)
    colors[:, 4:, 0] = 250  # u > 1/2, which is x > 1/2
    colors[4:, :, 1] = 200  # v > 1/2, downwards in the texture, which is y > 1/2 here
    found = loaded(write_ply(square(colors, WHOLE, scene)))
    x, y, _ = found.vertices.T
    red, green = found.visual.vertex_colors[:, 0], found.visual.vertex_colors[:, 1]
    assert (red[x > 0.6] == 250).all()
    assert (red[x < 0.4] == 0).all()
    assert (green[y > 0.6] == 200).all()
    assert (green[y < 0.4] == 0).all()


def test_holes_are_cut_out(scene: BakedScene) -> None:
    opaque = WHOLE.copy()
    opaque[:, :4] = False
    found = loaded(write_ply(square(GREY, opaque, scene)))
    assert found.area == pytest.approx(0.5)
    assert found.bounds[0][0] == pytest.approx(0.5)
    np.testing.assert_array_equal(found.visual.vertex_colors[:, :3], 90)  # of holes nothing is mixed in


def test_triangles_are_as_many_as_allowed_and_never_fewer_than_the_scenes(scene: BakedScene) -> None:
    flat = square(GREY, WHOLE, scene)
    assert len(loaded(write_ply(flat, most_triangles=20)).faces) == 2 * 3 * 3
    assert len(loaded(write_ply(flat, most_triangles=1)).faces) == 2


def test_triangles_are_no_finer_than_texels(scene: BakedScene) -> None:
    coarse = square(GREY[:2, :2], WHOLE[:2, :2], scene)
    assert len(loaded(write_ply(coarse)).faces) == 2 * 2 * 2


def test_scene_of_holes_is_refused(scene: BakedScene) -> None:
    with pytest.raises(SceneInvalid, match="opaque"):
        write_ply(square(GREY, ~WHOLE, scene))


def test_scene_without_area_is_refused(scene: BakedScene) -> None:
    flat = square(GREY, WHOLE, scene)
    page = replace(flat.pages[0], positions=np.zeros((4, 3), np.float32))
    with pytest.raises(SceneInvalid, match="area"):
        write_ply(replace(flat, pages=(page,)))
