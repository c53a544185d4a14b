"""What holds for every scene and camera."""

from dataclasses import replace

import numpy as np
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from core.camera import Camera
from core.render.raster import Rasteriser
from core.render.reference import render_deferred, render_forward
from tests.scenes import random_scene

COLOUR_TOLERANCE = 2e-6  # the network in float32
FEW = settings(max_examples=25, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck))

seeds = st.integers(0, 2**32 - 1)


@st.composite
def views(draw):
    """A camera anywhere in or around the unit ball, with any lens."""
    rng = np.random.default_rng(draw(seeds))
    rotation, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    pose = np.eye(4)
    pose[:3, :3] = rotation * np.sign(np.linalg.det(rotation))
    pose[:3, 3] = rng.normal(size=3) * draw(st.sampled_from([0.0, 0.3, 1.0, 3.0]))
    width, height = draw(st.integers(1, 40)), draw(st.integers(1, 40))
    focal = draw(st.floats(3, 300)), draw(st.floats(3, 300))
    centre = width * draw(st.floats(-0.5, 1.5)), height * draw(st.floats(-0.5, 1.5))
    return Camera("any", pose, focal, centre, (width, height))


@FEW
@given(seed=seeds, view=views())
def test_fast_and_reference_renderer_agree(seed, view):
    scene = random_scene(np.random.default_rng(seed), 12)
    rasteriser = Rasteriser(scene)
    pairs = [
        (rasteriser.deferred(view), render_deferred(scene, view)),
        (rasteriser.forward(view), render_forward(scene, view)),
    ]
    for actual, expected in pairs:
        # A ray that meets an edge to within rounding may fall either side: one pixel in a thousand is one here.
        assert (np.abs(actual - expected).max(-1) > COLOUR_TOLERANCE).sum() <= 1


@FEW
@given(seed=seeds, view=views())
def test_image_is_premultiplied_and_within_range(seed, view):
    image = Rasteriser(random_scene(np.random.default_rng(seed), 12)).deferred(view)
    assert np.isfinite(image).all()
    assert (image >= 0).all()
    assert (image[..., :3] <= image[..., 3:]).all()
    assert np.isin(image[..., 3], [0, 0.25, 0.5, 0.75, 1]).all()


@FEW
@given(seed=seeds, view=views())
def test_order_of_triangles_makes_no_difference(seed, view):
    rng = np.random.default_rng(seed)
    scene = random_scene(rng, 12)
    page = scene.pages[0]
    shuffled = replace(scene, pages=(replace(page, triangles=rng.permutation(page.triangles)),))
    np.testing.assert_array_equal(Rasteriser(shuffled).deferred(view), Rasteriser(scene).deferred(view))
