"""The browser hands the bytes of the feature PNGs to the shaders unchanged."""

from dataclasses import replace

import numpy as np
from playwright.sync_api import Page, expect

from core.baked import BakedScene
from tests.browser.conftest import open_scene
from tests.browser.site import Site
from tests.browser.viewer import ViewerPage


def test_every_byte_survives_the_browsers_decoder(page: Page, site: Site, scene: BakedScene) -> None:
    # Channels 3 and 7 are stored as alpha: with 0 and 1 among them, premultiplication anywhere on the way would show.
    first, *others = scene.pages
    written = replace(first, features_u8=_all_alphas(first.features_u8.shape[:2]))
    viewer = open_scene(page, site, replace(scene, pages=(written, *others)))
    for index, content in enumerate((written, *others)):
        np.testing.assert_array_equal(viewer.feature_texture(index, 0), content.features_u8[..., :4])
        np.testing.assert_array_equal(viewer.feature_texture(index, 1), content.features_u8[..., 4:])


def test_browser_that_alters_bytes_is_told_apart(page: Page, site: Site, scene: BakedScene) -> None:
    # A browser that ignores the options premultiplies.
    page.add_init_script("const make = createImageBitmap; window.createImageBitmap = (image) => make(image)")
    open_scene(page, site, scene)
    expect(page.locator("#note")).to_contain_text("alters the asset's data")


def test_browser_that_keeps_bytes_gets_no_note(viewer: ViewerPage) -> None:
    expect(viewer.page.locator("#note")).to_be_hidden()


def _all_alphas(size: tuple[int, int]) -> np.ndarray:
    """[height, width, 8] uint8: random, every value in every channel, alphas of 0 and 1 in the first rows."""
    features = np.random.default_rng(1).integers(0, 256, (*size, 8), np.uint8)
    features[:2, :, 3] = features[1:3, :, 7] = 0
    features[3:5, :, 3] = features[4:6, :, 7] = 1
    assert all(len(np.unique(features[..., channel])) == 256 for channel in range(8))
    return features
