"""The fast rasteriser shows what the reference renderer shows."""

from dataclasses import replace

import numpy as np
import pytest
import warp as wp

from core.camera import Camera
from core.device import usable_gpus
from core.render import raster_kernels
from core.render.raster import Rasteriser
from core.render.reference import render_deferred, render_forward, visibility
from core.render.visibility import subpixel_camera
from tests.scenes import look_at_camera, random_network, random_scene, tiny_scene
from tests.unit.render.quads import camera, facing_quad, page_of, plain, scene_of

# The network in float32: 16 products of order 1 a layer, rounded at 6e-8 each, through a sigmoid of slope 1/4.
COLOUR_TOLERANCE = 2e-6
# Geometry is float64 in both, so samples fall the other way only when a ray meets an edge to within rounding.
MOST_FLIPS = 0.001

NO_GPU = pytest.mark.skipif(usable_gpus() == 0, reason="no GPU that Warp and PyTorch can use")


@pytest.fixture(params=["cpu", pytest.param("cuda:0", marks=NO_GPU)])
def device(request):
    return request.param


def assert_same_image(actual, expected):
    assert actual.dtype == np.float32
    assert actual.shape == expected.shape
    different = np.abs(actual - expected).max(-1) > COLOUR_TOLERANCE
    assert different.mean() <= MOST_FLIPS, f"{100 * different.mean():.3f} % of the pixels differ"


def assert_agrees(scene, view, device="cpu"):
    rasteriser = Rasteriser(scene, device)
    assert_same_image(rasteriser.deferred(view), render_deferred(scene, view))
    assert_same_image(rasteriser.forward(view), render_forward(scene, view))
    seen, expected = rasteriser.visibility(view), visibility(scene, view)
    different = [getattr(seen, name) != getattr(expected, name) for name in ("page", "triangle", "row", "column")]
    assert np.any(different, 0).mean() <= MOST_FLIPS


def transformed(scene, view, scale, offset):
    """The scene and its camera, scaled and moved: it looks the same."""
    pages = tuple(replace(page, positions=(page.positions * scale + offset).astype(np.float32)) for page in scene.pages)
    pose = view.world_from_camera.copy()
    pose[:3, 3] = pose[:3, 3] * scale + offset
    return replace(scene, pages=pages), replace(view, world_from_camera=pose)


def test_agrees_on_two_pages_from_every_camera(scene, device):
    for view in scene.cameras:
        assert_agrees(scene, view, device)


def test_agrees_on_intersecting_quads(rng, device):
    scene = random_scene(rng, 60)
    assert_agrees(scene, scene.cameras[0], device)


@pytest.mark.parametrize("position", [(0.05, 0.02, 0.01), (0.3, 0.1, -0.2), (0.0, -0.6, 0.0)])
def test_agrees_with_the_camera_inside_the_scene(rng, device, position):
    wide = replace(look_at_camera("inside", position, size_px=(64, 48)), focal_px=(20.0, 20.0))
    assert_agrees(random_scene(rng, 60), wide, device)


@pytest.mark.parametrize("scale", [1e-6, 1e-3, 1e3, 1e6])
@pytest.mark.parametrize("offset", [0.0, 1e3])
def test_agrees_at_any_scale_and_offset(rng, device, scale, offset):
    scene = random_scene(rng, 30)
    assert_agrees(*transformed(scene, scene.cameras[0], scale, offset * scale), device)


def test_agrees_from_far_away_through_a_long_lens(rng):
    scene = random_scene(rng, 30)
    far = look_at_camera("far", (3e4, -2e4, 1e4), size_px=(64, 64))
    assert_agrees(scene, replace(far, focal_px=(8e5, 8e5)))


@pytest.mark.parametrize(
    "corners",
    [
        [[-99, -1, -9], [99, -1, -9], [99, -1, 7], [-99, -1, 7]],  # through the camera's plane
        [[-99, -1e-3, -9], [99, -1e-3, -9], [99, -1e-3, 7], [-99, -1e-3, 7]],  # grazing
        [[-9, -1, -5], [9, -1, -5], [9, -1, 0], [-9, -1, 0]],  # ends in the camera's plane
        [[0.5, -9, -9], [0.5, 9, -9], [0.5, 9, 5], [0.5, -9, 5]],
        [[-3, 1, 5], [3, 1, 5], [9, -1, -5], [-9, -1, -5]],
        [[0, 0, 0], [1, 0, -1], [1, 1, -1], [0, 1, 0]],  # a corner at the camera
        [[-1e-9, 0, -1], [1e-9, 0, -1], [1e-9, 1, -1], [-1e-9, 1, -1]],  # a sliver
        [[0, 0, -2]] * 4,
        [[-1, 0, -2], [1, 0, -2], [1, 0, -2], [-1, 0, -2]],
        [[-1, -1, 2], [1, -1, 2], [1, 1, 2], [-1, 1, 2]],  # behind
        [[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]],  # in the camera's plane
    ],
)
def test_agrees_on_awkward_quads(device, corners):
    scene = scene_of(page_of(np.full((16, 16, 8), 9, np.uint8), [np.array(corners, float)]))
    assert_agrees(scene, camera((33, 32)), device)


def test_shared_edges_leave_no_gap(rng, device):
    # A sheet of 40 x 40 quads, its inner vertices moved at random, fills the view: no sample may slip through.
    steps = np.linspace(-1.5, 1.5, 41)
    grid = np.stack([*np.meshgrid(steps, steps), np.full((41, 41), -1.0)], -1) + rng.normal(0, 0.005, (41, 41, 3))
    quads = np.stack([grid[:-1, :-1], grid[:-1, 1:], grid[1:, 1:], grid[1:, :-1]], 2).reshape(-1, 4, 3)
    scene = scene_of(page_of(plain(50), list(quads)))
    assert Rasteriser(scene, device).visibility(camera((500, 500))).hit.all()


def test_strips_make_no_difference(scene, device):
    view = scene.cameras[2]
    whole, strips = Rasteriser(scene, device), Rasteriser(scene, device, max_samples=2000)
    np.testing.assert_array_equal(strips.deferred(view), whole.deferred(view))
    np.testing.assert_array_equal(strips.forward(view), whole.forward(view))
    np.testing.assert_array_equal(strips.visibility(view).row, whole.visibility(view).row)


def test_a_strip_is_at_least_one_pixel_high(scene):
    view = scene.cameras[0].resized((40, 7))
    np.testing.assert_array_equal(Rasteriser(scene, max_samples=1).deferred(view), Rasteriser(scene).deferred(view))


def test_renders_repeat_bit_for_bit(scene, device):
    rasteriser = Rasteriser(scene, device)
    first = rasteriser.deferred(scene.cameras[0])
    rasteriser.deferred(scene.cameras[1])
    np.testing.assert_array_equal(rasteriser.deferred(scene.cameras[0]), first)


def test_equally_near_surfaces_show_the_first(device):
    scene = scene_of(*(page_of(plain(value), [facing_quad(2.0)]) for value in (50, 150, 200)))
    assert (Rasteriser(scene, device).visibility(camera()).page == 0).all()


def test_surfaces_closer_than_float32_depth_are_told_apart(device):
    # At a depth of 1e4 a float32 has steps of 1e-3.
    view = replace(camera((32, 32), position=(0.0, 0.0, 1e4)), focal_px=(1e5, 1e5))
    near = facing_quad(1.0) + np.array([0.0, 0.0, 1.0])
    scene = scene_of(page_of(plain(150), [near - [0.0, 0.0, 1e-4]]), page_of(plain(50), [near]))
    assert (Rasteriser(scene, device).visibility(view).page == 1).sum() == 20 * 20


def test_saturated_network_stays_finite(rng, device):
    scene = replace(tiny_scene(), network=random_network(rng, 1e3))
    image = Rasteriser(scene, device).deferred(scene.cameras[0])
    assert np.isfinite(image).all()
    assert (image[..., :3] <= image[..., 3:]).all()


def test_visibility_of_subpixels_gives_the_coverage(scene, device):
    rasteriser, view = Rasteriser(scene, device), scene.cameras[0]
    hit = rasteriser.visibility(subpixel_camera(view)).hit
    width, height = view.size_px
    coverage = hit.reshape(height, 2, width, 2).mean((1, 3))
    np.testing.assert_array_equal(rasteriser.deferred(view)[..., 3], coverage)


def test_one_pixel_image(scene, device):
    view = Camera("one", scene.cameras[0].world_from_camera, (1.0, 1.0), (0.5, 0.5), (1, 1))
    assert_agrees(scene, view, device)


def test_kernels_compile_for_cuda(tmp_path):
    wp.compile_aot_module(raster_kernels, arch=75, module_dir=tmp_path, strip_hash=True)
    assert list(tmp_path.glob("*.cubin"))
