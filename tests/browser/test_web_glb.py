"""The viewer shows the compressed files as the reference renderer shows what is read from them."""

from collections.abc import Callable

import numpy as np
import pytest
from playwright.sync_api import Page

from core.baked import BakedScene
from core.render.reference import render_deferred
from exporters.gltf import read_glb, write_lq_glb, write_web_glb
from tests.browser.site import Site
from tests.browser.viewer import open_viewer
from tests.parity.compare import FLIPPED_SHARE, compare, pixels_with_edges

INTERIOR_DB = 45.0  # as for the plain file


@pytest.mark.parametrize("write", [write_web_glb, write_lq_glb])
def test_viewer_shows_what_the_compressed_file_holds(
    page: Page, site: Site, scene: BakedScene, write: Callable[[BakedScene], dict[str, bytes]]
) -> None:
    ((name, glb),) = write(scene).items()
    site.files[f"/{name}"] = glb
    held = read_glb(glb)
    viewer = open_viewer(page, f"{site.url}/viewer.html?src=/{name}")
    for number, content in enumerate(held.pages):
        np.testing.assert_array_equal(viewer.feature_texture(number, 0), content.features_u8[..., :4])
        np.testing.assert_array_equal(viewer.feature_texture(number, 1), content.features_u8[..., 4:])
    for view, camera in enumerate(held.cameras):
        actual = viewer.render(view, "deferred", camera.size_px)
        comparison = compare(actual, render_deferred(held, camera), pixels_with_edges(held, camera))
        assert comparison.interior_psnr >= INTERIOR_DB, str(comparison)
        assert comparison.flipped_share <= FLIPPED_SHARE, str(comparison)
