"""The three.js viewer shows what the reference renderer shows."""

from dataclasses import replace

import numpy as np
import pytest
from playwright.sync_api import Page

from core.baked import BakedScene
from core.render.reference import render_deferred, render_forward
from tests.browser.conftest import open_scene
from tests.browser.site import Site
from tests.browser.viewer import ViewerPage
from tests.parity.compare import compare, pixels_with_edges
from tests.scenes import look_at_camera, random_scene

# Rounding to 8 bits alone gives 59 dB; a wrong direction, a wrong texel row or altered bytes less than 40.
INTERIOR_DB = 45.0
# WebGL snaps vertices to a fraction of a pixel and computes in float32: a few samples on edges fall on the other side.
FLIPPED_SHARE = 0.005
REFERENCES = {"deferred": render_deferred, "forward": render_forward}
MODES = tuple(REFERENCES)


def assert_equal_but_for_edges(viewer: ViewerPage, scene: BakedScene, view: int, mode: str) -> None:
    camera = scene.cameras[view]
    actual = viewer.render(view, mode, camera.size_px)
    comparison = compare(actual, REFERENCES[mode](scene, camera), pixels_with_edges(scene, camera))
    assert comparison.interior_psnr >= INTERIOR_DB, str(comparison)
    assert comparison.flipped_share <= FLIPPED_SHARE, str(comparison)


def test_viewer_matches_the_reference_from_every_camera(viewer: ViewerPage, scene: BakedScene) -> None:
    for view in range(len(scene.cameras)):
        for mode in MODES:
            assert_equal_but_for_edges(viewer, scene, view, mode)


@pytest.mark.parametrize(("scale", "distance"), [(2.5, 2.0), (1e-6, 1e6), (1e6, 1e6)])
def test_turned_moved_and_scaled_asset_keeps_its_shading(
    page: Page, site: Site, scene: BakedScene, scale: float, distance: float
) -> None:
    placed = replace(scene, asset_from_object=placement(scale, distance))
    viewer = open_scene(page, site, placed)
    for mode in MODES:
        assert_equal_but_for_edges(viewer, placed, 2, mode)


def test_loose_intersecting_quads_match_the_reference(page: Page, site: Site) -> None:
    loose = random_scene(np.random.default_rng(5))
    viewer = open_scene(page, site, loose)
    for mode in MODES:
        assert_equal_but_for_edges(viewer, loose, 0, mode)


def test_camera_that_is_not_in_the_asset_matches_the_reference(viewer: ViewerPage, scene: BakedScene) -> None:
    camera = look_at_camera("elsewhere", (-0.9, -1.8, -0.7), size_px=(120, 90))
    actual = viewer.render(camera, "deferred", camera.size_px)
    comparison = compare(actual, render_deferred(scene, camera), pixels_with_edges(scene, camera))
    assert comparison.interior_psnr >= INTERIOR_DB, str(comparison)


def test_another_size_scales_the_view(viewer: ViewerPage, scene: BakedScene) -> None:
    camera = scene.cameras[2].resized((288, 256))
    actual = viewer.render(2, "deferred", camera.size_px)
    comparison = compare(actual, render_deferred(scene, camera), pixels_with_edges(scene, camera))
    assert comparison.interior_psnr >= INTERIOR_DB, str(comparison)


def placement(scale: float, distance: float) -> np.ndarray:
    """An asset_from_object that turns, scales, and moves by `distance` times its scale."""
    cos, sin = np.cos(0.8), np.sin(0.8)
    rotation = np.array([[cos, -sin, 0], [sin, cos, 0], [0, 0, 1]]) @ np.array([[1, 0, 0], [0, 0, 1], [0, -1, 0]])
    matrix = np.eye(4)
    matrix[:3, :3] = scale * rotation
    matrix[:3, 3] = scale * distance * np.array([0.8, -0.2, 0.4])
    return matrix
