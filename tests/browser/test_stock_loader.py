"""A viewer that does not know the extension shows the fallback."""

import io
from collections.abc import Callable

import numpy as np
import pytest
from PIL import Image
from playwright.sync_api import Page

from core.baked import BakedScene
from core.camera import Camera
from core.render.reference import visibility
from exporters.gltf import read_glb, write_glb, write_lq_glb, write_web_glb
from tests.browser.site import Site
from tests.parity.compare import pixels_with_edges

# A colour goes to linear light and back on its way: half a step of rounding each.
TOLERANCE = 2
Writer = Callable[[BakedScene], dict[str, bytes]]


@pytest.mark.parametrize("write", [write_glb, write_web_glb, write_lq_glb])
def test_stock_loader_shows_the_baked_mean_colours(page: Page, site: Site, scene: BakedScene, write: Writer) -> None:
    (glb,) = write(scene).values()
    site.files["/scene.glb"] = glb
    scene = read_glb(glb)
    camera = scene.cameras[0]
    width, height = camera.size_px
    page.goto(f"{site.url}/pages/stock.html?src=/scene.glb&width={width}&height={height}")
    assert "POLYFIELD_materials_neural" in page.evaluate("shown")
    shown = _pixels(page.locator("canvas").screenshot())

    expected, seen = _fallback(scene, camera)
    differs = np.abs(shown.astype(int) - expected).max(-1) > TOLERANCE
    interior = ~pixels_with_edges(scene, camera)
    assert seen.mean() > 0.3
    assert (differs & interior).sum() <= 0.005 * seen.sum()  # texels whose border runs through a pixel's centre
    assert differs.sum() <= 0.01 * seen.sum()


def _fallback(scene: BakedScene, camera: Camera) -> tuple[np.ndarray, np.ndarray]:
    """[h, w, 3] uint8 over white, and [h, w] bool where something is seen."""
    seen = visibility(scene, camera)
    picture = np.full((*seen.page.shape, 3), 255, np.uint8)
    for index, page in enumerate(scene.pages):
        here = seen.page == index
        picture[here] = page.colors_u8[seen.row[here], seen.column[here]]
    return picture, seen.hit


def _pixels(png: bytes) -> np.ndarray:
    return np.asarray(Image.open(io.BytesIO(png)).convert("RGB"))
