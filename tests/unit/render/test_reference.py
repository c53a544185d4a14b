"""The reference renderer against closed forms, and its visibility against another algorithm."""

import numpy as np
import pytest

from core.conventions import SUBPIXEL_OFFSETS_PX, feature_from_byte
from core.render.reference import render_deferred, render_forward, visibility
from core.render.visibility import subpixel_camera
from tests.scenes import random_scene, tiny_scene
from tests.unit.render.quads import camera, facing_quad, page_of, plain, scene_of

EXACT = 1e-12  # both sides are float64; only the order of operations differs


def shaded(scene, view, value):
    """[h, w, 3]: what a plain surface of features value / 255 looks like."""
    directions = view.directions(view.pixel_centres())
    return scene.network(np.full((*directions.shape[:2], 8), value / 255), directions)


@pytest.mark.parametrize("render", [render_deferred, render_forward])
def test_surface_that_fills_the_view_shows_the_network_in_every_pixel(render):
    scene, view = scene_of(page_of(plain(100), [facing_quad(3.0, left=-2, right=2, bottom=-2, top=2)])), camera()
    image = render(scene, view)
    np.testing.assert_allclose(image[..., :3], shaded(scene, view, 100), atol=EXACT)
    np.testing.assert_array_equal(image[..., 3], 1.0)


@pytest.mark.parametrize("render", [render_deferred, render_forward])
def test_nothing_is_seen_beside_a_surface(render):
    image = render(scene_of(page_of(plain(100), [facing_quad(3.0, right=-0.5)])), camera())
    assert (image[:, :2, 3] == 1).all()
    assert (image[:, 2:] == 0).all()


def test_subpixels_are_where_the_conventions_put_them():
    view = camera((6, 4))
    fine = subpixel_camera(view)
    for sample, offset in enumerate(SUBPIXEL_OFFSETS_PX):
        expected = view.directions(view.pixel_centres() + offset)
        found = fine.directions(fine.pixel_centres())[sample // 2 :: 2, sample % 2 :: 2]
        np.testing.assert_allclose(found, expected, atol=EXACT)


@pytest.mark.parametrize(("edge_px", "coverage"), [(2.1, 0.0), (2.3, 0.5), (2.7, 0.5), (2.8, 1.0)])
def test_coverage_is_the_share_of_covered_subpixels(edge_px, coverage):
    scene = scene_of(page_of(plain(100), [facing_quad(3.0, right=edge_px / 4 - 1)]))
    image = render_deferred(scene, camera())
    np.testing.assert_array_equal(image[:, 2, 3], coverage)
    np.testing.assert_allclose(image[:, 2, :3], shaded(scene, camera(), 100)[:, 2] * coverage, atol=EXACT)


def test_pixel_averages_features_and_is_shaded_once():
    # The boundary between the two texels runs through the middle of column 4's pixels.
    quad = facing_quad(1.0, left=-7 / 8, right=9 / 8)
    scene, view = scene_of(page_of(plain(10, 200), [quad])), camera()
    image = render_deferred(scene, view)
    np.testing.assert_allclose(image[:, 4, :3], shaded(scene, view, 105)[:, 4], atol=EXACT)


def test_average_leaves_uncovered_subpixels_out():
    quad = facing_quad(1.0, left=-7 / 8, right=9 / 8)
    scene, view = scene_of(page_of(plain(0, 200), [quad])), camera()
    image = render_deferred(scene, view)
    np.testing.assert_allclose(image[:, 4, :3], shaded(scene, view, 200)[:, 4] * 0.5, atol=EXACT)
    np.testing.assert_array_equal(image[:, 4, 3], 0.5)


@pytest.mark.parametrize("order", [1, -1])
def test_nearest_surface_is_seen_whatever_the_order(order):
    pages = [page_of(plain(50), [facing_quad(2.0)]), page_of(plain(150), [facing_quad(3.0)])]
    scene = scene_of(*pages[::order])
    np.testing.assert_allclose(render_forward(scene, camera())[..., :3], shaded(scene, camera(), 50), atol=EXACT)


def test_hole_shows_what_lies_behind():
    scene = scene_of(page_of(plain(0), [facing_quad(2.0)]), page_of(plain(150), [facing_quad(3.0)]))
    np.testing.assert_allclose(render_forward(scene, camera())[..., :3], shaded(scene, camera(), 150), atol=EXACT)


def test_surface_is_seen_from_both_sides():
    front = scene_of(page_of(plain(50), [facing_quad(2.0)]))
    back = scene_of(page_of(plain(50), [facing_quad(2.0)[::-1]]))
    np.testing.assert_array_equal(visibility(back, camera()).hit, visibility(front, camera()).hit)


def test_page_is_upright():
    seen = visibility(scene_of(page_of(np.full((4, 8, 8), 9, np.uint8), [facing_quad(2.0)])), camera((16, 16)))
    rows, columns = np.meshgrid(np.arange(16) // 4, np.arange(16) // 2, indexing="ij")
    np.testing.assert_array_equal(seen.row, rows)
    np.testing.assert_array_equal(seen.column, columns)


def test_texture_is_perspective_correct_and_reaches_behind_the_camera():
    # A floor at y = -1 from z = -9 to z = +7 (behind the camera), 16 texels along z, seen to the horizon.
    floor = np.array([[-99.0, -1, -9], [99, -1, -9], [99, -1, 7], [-99, -1, 7]])
    seen = visibility(scene_of(page_of(np.full((16, 1, 8), 9, np.uint8), [floor])), camera((32, 256)))
    slope = (np.arange(256) + 0.5 - 128) / 128  # downwards per unit of depth
    with np.errstate(divide="ignore"):
        depth = np.where(slope > 0, 1 / slope, np.inf)
    expected = depth < 9
    np.testing.assert_array_equal(seen.hit, np.tile(expected[:, None], 32))
    np.testing.assert_array_equal(seen.row[expected, 0], np.floor(9 - depth[expected]))


@pytest.mark.parametrize(
    "corners",
    [
        [[0, 0, -2]] * 4,
        [[-1, 0, -2], [1, 0, -2], [1, 0, -2], [-1, 0, -2]],
        [[-1, 0, -1], [1, 0, -1], [1, 0, -5], [-1, 0, -5]],  # the camera lies in its plane
        [[-1, -1, 2], [1, -1, 2], [1, 1, 2], [-1, 1, 2]],  # behind
        [[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]],  # in the camera's own plane
        [[0, 0, 0], [0, 0, 0], [0, 0, -1], [0, 0, -1]],  # a line through the camera
    ],
    ids=["point", "line", "edge-on", "behind", "at the camera", "axis"],
)
def test_degenerate_and_hidden_quads_are_invisible(corners):
    scene = scene_of(page_of(plain(50), [np.array(corners, float)]))
    assert not render_deferred(scene, camera((9, 9))).any()


def test_premultiplied_colour_never_exceeds_coverage(scene):
    for view in scene.cameras:
        image = render_deferred(scene, view)
        assert (image >= 0).all()
        assert (image[..., :3] <= image[..., 3:]).all()


@pytest.mark.parametrize("make", [tiny_scene, lambda: random_scene(np.random.default_rng(5), 30)])
def test_visibility_agrees_with_moller_trumbore(make):
    scene = make()
    view = scene.cameras[0].resized((40, 30))
    seen = visibility(scene, view)
    found = [moller_trumbore(scene, view.position, d) for d in view.directions(view.pixel_centres()).reshape(-1, 3)]
    expected = np.array(found).T.reshape(4, *seen.page.shape)
    actual = np.stack([seen.page, seen.triangle, seen.row, seen.column])
    assert (actual != expected).any(0).sum() <= 1  # a ray may meet an edge exactly


def moller_trumbore(scene, origin, direction):
    """(page, triangle, row, column) of the nearest opaque texel on a ray (Moller and Trumbore 1997)."""
    best, found = np.inf, (-1, 0, 0, 0)
    for number, page in enumerate(scene.pages):
        v0, v1, v2 = np.moveaxis(page.positions.astype(float)[page.triangles], 1, 0)
        e1, e2 = v1 - v0, v2 - v0
        p = np.cross(direction, e2)
        determinant = (e1 * p).sum(-1)
        u = ((origin - v0) * p).sum(-1) / determinant
        q = np.cross(origin - v0, e1)
        v = (q @ direction) / determinant
        t = (e2 * q).sum(-1) / determinant
        for index in np.flatnonzero((u >= 0) & (v >= 0) & (u + v <= 1) & (t > 0) & (t < best)):
            weights = [1 - u[index] - v[index], u[index], v[index]]
            texcoord = weights @ page.texcoords[page.triangles[index]].astype(float)
            column, row = (int(c) for c in texcoord * page.features_u8.shape[1::-1])
            if feature_from_byte(page.features_u8)[row, column, 0] > 0 and t[index] < best:
                best, found = t[index], (number, int(index), row, column)
    return found
