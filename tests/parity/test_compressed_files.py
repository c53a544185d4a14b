"""The compressed files' own shaders, run by OpenGL, show what the reference renderer shows of the scene before."""

from collections.abc import Callable

import moderngl
import numpy as np
import pytest

from core.baked import BakedScene
from core.render.reference import render_deferred
from exporters.compaction import repacked
from exporters.gltf import write_glb, write_lq_glb, write_web_glb
from tests.parity.compare import FLIPPED_SHARE, INTERIOR_DB, QUANTISED_DB, QUANTISED_VISIBLE, compare, pixels_with_edges
from tests.parity.gl_renderer import GlRenderer
from tests.scenes import random_scene

# Half the texels a side of noise made by hand, which has nothing to average away.
PHONE_DB, PHONE_FLIPPED = 25.0, 0.08


def test_web_glb_shows_the_scene_it_was_made_from(context: moderngl.Context, scene: BakedScene) -> None:
    renderer = GlRenderer(context, write_web_glb(scene)["scene.web.glb"])
    for before, now in zip(scene.cameras, renderer.scene.cameras, strict=True):
        comparison = compare(
            renderer.render(now, "deferred"),
            render_deferred(scene, before),
            pixels_with_edges(scene, before),
            visible=QUANTISED_VISIBLE,
        )
        assert comparison.interior_psnr >= QUANTISED_DB, str(comparison)
        assert comparison.flipped_share <= FLIPPED_SHARE, str(comparison)


@pytest.mark.parametrize("write", [write_web_glb, write_lq_glb])
def test_compressed_file_is_drawn_as_it_is_read(
    context: moderngl.Context, scene: BakedScene, write: Callable[[BakedScene], dict[str, bytes]]
) -> None:
    (glb,) = write(scene).values()
    renderer = GlRenderer(context, glb)
    for camera in renderer.scene.cameras:
        reference = render_deferred(renderer.scene, camera)
        comparison = compare(renderer.render(camera, "deferred"), reference, pixels_with_edges(renderer.scene, camera))
        assert comparison.interior_psnr >= INTERIOR_DB, str(comparison)
        assert comparison.flipped_share <= FLIPPED_SHARE, str(comparison)


def test_lq_glb_shows_nearly_the_scene_it_was_made_from(context: moderngl.Context, scene: BakedScene) -> None:
    renderer = GlRenderer(context, write_lq_glb(scene)["scene.lq.glb"])
    before, now = scene.cameras[0], renderer.scene.cameras[0]
    actual, reference = renderer.render(now, "deferred"), render_deferred(scene, before)
    comparison = compare(actual, reference, pixels_with_edges(scene, before), visible=1.0)
    assert comparison.interior_psnr >= PHONE_DB, str(comparison)
    assert comparison.flipped_share <= PHONE_FLIPPED, str(comparison)


@pytest.mark.parametrize("seed", range(2))
def test_repacked_scene_shows_the_same(context: moderngl.Context, seed: int) -> None:
    scene = random_scene(np.random.default_rng(seed))
    renderer = GlRenderer(context, write_glb(repacked(scene))["scene.glb"])
    camera = scene.cameras[0]
    comparison = compare(
        renderer.render(camera, "deferred"), render_deferred(scene, camera), pixels_with_edges(scene, camera)
    )
    assert comparison.interior_psnr >= INTERIOR_DB, str(comparison)
