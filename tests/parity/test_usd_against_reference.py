"""The USD's own shaders, run by OpenGL, show what the reference renderer shows; the asset's frame included."""

from dataclasses import replace
from pathlib import Path

import moderngl
import numpy as np
import pytest
from pxr import UsdGeom

from core.baked import BakedScene
from core.render.reference import render_forward, visibility
from exporters.usd import write_usd
from exporters.usd.quicklook import write_quicklook
from exporters.usd.writer import Form
from tests.parity.compare import FLIPPED_SHARE, INTERIOR_DB, Comparison, compare, pixels_with_edges
from tests.parity.gl_matrices import in_asset
from tests.parity.usd_renderer import Look, UsdRenderer
from tests.scenes import random_scene

NEURAL: tuple[Look, ...] = ("storm", "materialx")
FORMS: tuple[Form, ...] = ("usdc", "usda", "usdz")


def compared(renderer: UsdRenderer, scene: BakedScene) -> list[Comparison]:
    return [
        compare(
            renderer.render(in_asset(camera, scene.asset_from_object)),
            render_forward(scene, camera),
            pixels_with_edges(scene, camera),
        )
        for camera in scene.cameras
    ]


def assert_shows_the_scene(renderer: UsdRenderer, scene: BakedScene) -> None:
    for comparison in compared(renderer, scene):
        assert comparison.interior_psnr >= INTERIOR_DB, str(comparison)
        assert comparison.flipped_share <= FLIPPED_SHARE, str(comparison)


def placed(scene: BakedScene) -> BakedScene:
    """The scene in an asset that is turned about a skew axis, scaled and moved."""
    turn = np.array([[0.36, 0.48, -0.8], [-0.8, 0.6, 0.0], [0.48, 0.64, 0.6]])
    matrix = np.eye(4)
    matrix[:3, :3] = 3.7 * turn
    matrix[:3, 3] = (5.0, -3.0, 0.4)
    return replace(scene, asset_from_object=matrix)


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("look", NEURAL)
def test_network_shows_what_the_reference_shows(
    context: moderngl.Context, scene: BakedScene, tmp_path: Path, look: Look, form: Form
) -> None:
    assert_shows_the_scene(UsdRenderer(context, write_usd(scene, form), tmp_path, look), scene)


@pytest.mark.parametrize("look", NEURAL)
def test_turned_moved_and_scaled_asset_keeps_its_shading(
    context: moderngl.Context, scene: BakedScene, tmp_path: Path, look: Look
) -> None:
    assert_shows_the_scene(UsdRenderer(context, write_usd(placed(scene)), tmp_path, look), placed(scene))


@pytest.mark.parametrize("look", NEURAL)
def test_filter_of_the_textures_does_not_matter(
    context: moderngl.Context, scene: BakedScene, tmp_path: Path, look: Look
) -> None:
    assert_shows_the_scene(UsdRenderer(context, write_usd(scene), tmp_path, look, smooth=True), scene)


@pytest.mark.parametrize("look", NEURAL)
def test_loose_intersecting_quads_match_the_reference(context: moderngl.Context, tmp_path: Path, look: Look) -> None:
    scene = random_scene(np.random.default_rng(5))
    assert_shows_the_scene(UsdRenderer(context, write_usd(scene), tmp_path, look), scene)


def test_fallback_shows_the_mean_colours(context: moderngl.Context, scene: BakedScene, tmp_path: Path) -> None:
    renderer = UsdRenderer(context, write_usd(scene), tmp_path, "preview")
    for camera in scene.cameras:
        seen = visibility(scene, camera)
        shown = np.zeros((*seen.hit.shape, 4))
        for index, page in enumerate(scene.pages):
            here = seen.hit & (seen.page == index)
            shown[here, :3] = page.colors_u8[seen.row[here], seen.column[here]] / 255
        shown[..., 3] = seen.hit
        actual = renderer.render(in_asset(camera, scene.asset_from_object))
        comparison = compare(actual, shown, pixels_with_edges(scene, camera))
        assert comparison.interior_psnr >= INTERIOR_DB, str(comparison)
        assert comparison.flipped_share <= FLIPPED_SHARE, str(comparison)


def test_quick_look_asset_looks_like_the_fallback(context: moderngl.Context, scene: BakedScene, tmp_path: Path) -> None:
    fallback = UsdRenderer(context, write_usd(scene), tmp_path, "preview")
    phone = UsdRenderer(context, write_quicklook(scene), tmp_path, "preview", smooth=True)
    standing = np.array(UsdGeom.XformCache().GetLocalToWorldTransform(phone.stage.GetDefaultPrim())).T
    for camera in scene.cameras:
        expected = fallback.render(in_asset(camera, scene.asset_from_object))
        actual = phone.render(in_asset(camera, standing))
        assert -10 * np.log10(((actual - expected) ** 2).mean()) > 24  # texels have other borders
        assert np.abs(actual[..., 3] - expected[..., 3]).mean() < 0.02


# In the text of scene.usda: right, wrong.
MISTAKES = {
    "direction not turned into the object": ("transpose(view_from_object) * ray", "ray", "storm"),
    "colours not made linear": ("linear_from_srgb(shaded(f0, f1, direction))", "shaded(f0, f1, direction)", "storm"),
    "texture upside down": ("vec2 texel = (floor(HdGet_st()", "vec2 texel = (floor(vec2(0, 1) - HdGet_st()", "storm"),
    "direction left in the world": (
        "inputs:in.connect = </scene/materials/neural/network/view_object.outputs:out>",
        "inputs:in.connect = </scene/materials/neural/network/view_world.outputs:out>",
        "materialx",
    ),
    "no negative slope": ("float inputs:in2 = 0\n", "float inputs:in2 = -9\n", "materialx"),
    "fewer texels than there are": ("float2 inputs:value = (128, 64)", "float2 inputs:value = (64, 64)", "materialx"),
}


@pytest.mark.parametrize(("right", "wrong", "look"), MISTAKES.values(), ids=MISTAKES.keys())
def test_mistake_is_noticed(
    context: moderngl.Context, scene: BakedScene, tmp_path: Path, right: str, wrong: str, look: Look
) -> None:
    files = write_usd(scene, "usda")
    text = files["scene.usda"].decode()
    assert right in text
    renderer = UsdRenderer(context, {**files, "scene.usda": text.replace(right, wrong).encode()}, tmp_path, look)
    assert any(c.interior_psnr < INTERIOR_DB or c.flipped_share > FLIPPED_SHARE for c in compared(renderer, scene))
