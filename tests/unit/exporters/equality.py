"""Whether a scene that was read is the one that was written."""

from dataclasses import fields, replace

import numpy as np

from core.baked import BakedScene, Page
from core.camera import Camera
from exporters.fallback import mean_colors

ROUNDING = 1e-6  # of float32 numbers of order 1 that were turned and turned back


def assert_equal(actual: BakedScene, expected: BakedScene) -> None:
    """Bit for bit."""
    assert len(actual.pages) == len(expected.pages)
    for page, wanted in zip(actual.pages, expected.pages, strict=True):
        for field in fields(Page):
            _assert_array_equal(getattr(page, field.name), getattr(wanted, field.name), field.name)
    for array, wanted_array in zip(
        (*actual.network.weights, *actual.network.biases),
        (*expected.network.weights, *expected.network.biases),
        strict=True,
    ):
        _assert_array_equal(array, wanted_array, "network")
    assert actual.background == expected.background
    _assert_array_equal(actual.asset_from_object, expected.asset_from_object, "asset_from_object")
    assert [_camera(c) for c in actual.cameras] == [_camera(c) for c in expected.cameras]


def assert_equal_within_rounding(actual: BakedScene, expected: BakedScene) -> None:
    """As `assert_equal`, but for the rounding of positions and weights in another frame."""
    for page, wanted in zip(actual.pages, expected.pages, strict=True):
        np.testing.assert_allclose(page.positions, wanted.positions, rtol=ROUNDING, atol=ROUNDING)
        for name in ("texcoords", "triangles", "features_u8"):
            np.testing.assert_array_equal(getattr(page, name), getattr(wanted, name))
        assert np.abs(page.colors_u8.astype(int) - wanted.colors_u8).max() <= 1
    for weight, wanted_weight in zip(actual.network.weights, expected.network.weights, strict=True):
        np.testing.assert_allclose(weight, wanted_weight, rtol=0, atol=ROUNDING)
    for field in fields(BakedScene):
        if field.name not in ("pages", "network", "cameras"):
            assert np.array_equal(getattr(actual, field.name), getattr(expected, field.name)), field.name


def as_kept_by_mobilenerf(scene: BakedScene) -> BakedScene:
    """What MobileNeRF's layout keeps of a scene: odd levels of features 3 and 7, estimated colours."""
    pages = []
    for page in scene.pages:
        features_u8 = page.features_u8.copy()
        features_u8[..., [3, 7]] |= (features_u8[..., :1] > 0).astype(np.uint8)
        colors_u8 = mean_colors(scene.network, features_u8)
        pages.append(replace(page, features_u8=features_u8, colors_u8=colors_u8))
    return replace(scene, pages=tuple(pages))


def _assert_array_equal(actual: np.ndarray, expected: np.ndarray, name: str) -> None:
    assert (actual.dtype, actual.shape) == (expected.dtype, expected.shape), name
    equal = actual.tobytes() == np.ascontiguousarray(expected).tobytes()  # tells -0.0 from 0.0
    assert equal, f"{name}: {int((actual != expected).sum())} of {actual.size} numbers differ"


def _camera(camera: Camera) -> tuple:
    return camera.name, camera.world_from_camera.tolist(), camera.focal_px, camera.centre_px, camera.size_px
