"""The .glb's own shaders, run by OpenGL, show what the reference renderer shows."""

from dataclasses import replace

import moderngl
import numpy as np
import pytest

from core.baked import BakedScene
from core.camera import Camera
from core.render.reference import render_deferred, render_forward
from exporters.glsl import Dialect
from exporters.gltf import write_glb
from tests.parity.compare import FLIPPED_SHARE, INTERIOR_DB, Comparison, compare, pixels_with_edges
from tests.parity.gl_renderer import GlRenderer, Mode
from tests.scenes import look_at_camera, random_network, random_scene

REFERENCES = {"deferred": render_deferred, "forward": render_forward}
MODES: tuple[Mode, ...] = ("deferred", "forward")
DIALECTS: tuple[Dialect, ...] = ("glsl330", "essl300")


@pytest.fixture
def renderer(context: moderngl.Context, scene: BakedScene) -> GlRenderer:
    return GlRenderer(context, write_glb(scene)["scene.glb"])


def compared(
    renderer: GlRenderer, camera: Camera, mode: Mode, world_from_object: np.ndarray | None = None
) -> Comparison:
    """The renderer against the reference; `camera` in the object frame, moved into the world with the object."""
    seen_from = camera if world_from_object is None else _moved(camera, world_from_object)
    actual = renderer.render(seen_from, mode, world_from_object)
    reference = REFERENCES[mode](renderer.scene, camera)
    return compare(actual, reference, pixels_with_edges(renderer.scene, camera))


def assert_equal_but_for_edges(comparison: Comparison) -> None:
    assert comparison.interior_psnr >= INTERIOR_DB, str(comparison)
    assert comparison.flipped_share <= FLIPPED_SHARE, str(comparison)


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("dialect", DIALECTS)
def test_shaders_match_the_reference_from_every_camera(
    context: moderngl.Context, scene: BakedScene, dialect: Dialect, mode: Mode
) -> None:
    renderer = GlRenderer(context, write_glb(scene)["scene.glb"], dialect)
    for camera in scene.cameras:
        assert_equal_but_for_edges(compared(renderer, camera, mode))


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("mode", MODES)
def test_loose_intersecting_quads_match_the_reference(context: moderngl.Context, seed: int, mode: Mode) -> None:
    scene = random_scene(np.random.default_rng(seed))
    renderer = GlRenderer(context, write_glb(scene)["scene.glb"])
    assert_equal_but_for_edges(compared(renderer, scene.cameras[0], mode))


@pytest.mark.parametrize(("scale", "distance"), [(3.7, 1.5), (1e-6, 1e6), (1e6, 1e6)])
@pytest.mark.parametrize("mode", MODES)
def test_turned_moved_and_scaled_object_keeps_its_shading(
    renderer: GlRenderer, mode: Mode, scale: float, distance: float
) -> None:
    camera = renderer.scene.cameras[2]
    assert_equal_but_for_edges(compared(renderer, camera, mode, _placement(scale, distance)))


def test_placed_scene_written_and_read_looks_the_same(context: moderngl.Context, scene: BakedScene) -> None:
    placed = replace(scene, asset_from_object=_placement(1e6, 1e6), user_from_object=_placement(1e-6, 1e6))
    here, there = (GlRenderer(context, write_glb(each)["scene.glb"]) for each in (scene, placed))
    camera = scene.cameras[0]
    far_away = _moved(camera, there.scene.asset_from_object)
    actual = there.render(far_away, "deferred", there.scene.asset_from_object)
    comparison = compare(actual, here.render(camera, "deferred"), pixels_with_edges(scene, camera))
    assert_equal_but_for_edges(comparison)


@pytest.mark.parametrize("mode", MODES)
def test_grazing_view_matches_the_reference(renderer: GlRenderer, mode: Mode) -> None:
    # Along the sheet's rim: its quads are seen at a few degrees.
    camera = look_at_camera("grazing", (0.05, -0.6, 2.6), size_px=(128, 96))
    assert_equal_but_for_edges(compared(renderer, camera, mode))


@pytest.mark.parametrize("mode", MODES)
def test_camera_within_the_object_matches_the_reference(renderer: GlRenderer, mode: Mode) -> None:
    # A wide lens with quads 0.03 in front of it, others beside and behind.
    camera = replace(look_at_camera("close", (0.02, -0.52, 0.03), size_px=(96, 96)), focal_px=(30.0, 30.0))
    assert_equal_but_for_edges(compared(renderer, camera, mode))


def test_pass_one_leaves_the_stored_bytes_in_its_targets(renderer: GlRenderer) -> None:
    seen = renderer.render_features(renderer.scene.cameras[0]).reshape(-1, 8)
    texels = np.concatenate([page.features_u8.reshape(-1, 8) for page in renderer.scene.pages])
    stored = {tuple(texel) for texel in texels[texels[:, 0] > 0]}
    shown = {tuple(texel) for texel in seen[seen[:, 0] > 0]}
    assert len(shown) > 1000
    assert shown <= stored
    assert not seen[seen[:, 0] == 0].any()


@pytest.mark.parametrize("gain", [1e2, 1e6])
@pytest.mark.parametrize("mode", MODES)
def test_saturated_network_shows_only_valid_colours(
    context: moderngl.Context, scene: BakedScene, mode: Mode, gain: float
) -> None:
    saturated = replace(scene, network=random_network(np.random.default_rng(3), gain))
    renderer = GlRenderer(context, write_glb(saturated)["scene.glb"])
    camera = scene.cameras[0]
    actual, reference = renderer.render(camera, mode), REFERENCES[mode](saturated, camera)
    # Where a logit passes through zero the colour jumps, so float32 rounding may show there, in under 1 % of pixels.
    # NaN or infinity would show all over.
    shown = (actual[..., 3] == 1) & (reference[..., 3] == 1)
    differs = (np.abs(actual - reference).max(-1) > 3 / 255)[shown]
    assert shown.sum() > 1000
    assert differs.mean() < 0.01


def _placement(scale: float, distance: float) -> np.ndarray:
    """A world_from_object that turns about a skew axis, scales, and moves by `distance` times its scale."""
    axis = np.array([1.0, -2.0, 0.5]) / np.sqrt(5.25)
    cross = np.cross(np.eye(3), -axis)
    rotation = np.eye(3) + np.sin(2.1) * cross + (1 - np.cos(2.1)) * cross @ cross  # Rodrigues
    matrix = np.eye(4)
    matrix[:3, :3] = scale * rotation
    matrix[:3, 3] = scale * distance * np.array([0.8, -0.5, 0.1])
    return matrix


def _moved(camera: Camera, world_from_object: np.ndarray) -> Camera:
    """The camera that sees the placed object as `camera` sees the object."""
    pose = world_from_object @ camera.world_from_camera
    pose[:3, :3] /= np.cbrt(np.linalg.det(world_from_object[:3, :3]))
    return replace(camera, world_from_camera=pose)
