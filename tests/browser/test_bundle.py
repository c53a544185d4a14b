"""Bundles show their scene from any static host, and from a file that is simply opened."""

from pathlib import Path

import pytest
from playwright.sync_api import Page, expect

from core.baked import BakedScene
from core.render.reference import render_deferred
from exporters.gltf import read_glb, write_glb, write_web_glb
from exporters.viewer import write_viewer_bundle, write_viewer_html
from tests.browser.site import Site
from tests.browser.viewer import ViewerPage, open_viewer
from tests.parity.compare import FLIPPED_SHARE, compare, pixels_with_edges

INTERIOR_DB = 45.0  # as in the viewer's own tests


def assert_shows(viewer: ViewerPage, glb: bytes) -> None:
    held = read_glb(glb)
    camera = held.cameras[0]
    actual = viewer.render(0, "deferred", camera.size_px)
    comparison = compare(actual, render_deferred(held, camera), pixels_with_edges(held, camera))
    assert comparison.interior_psnr >= INTERIOR_DB, str(comparison)
    assert comparison.flipped_share <= FLIPPED_SHARE, str(comparison)


@pytest.mark.parametrize("folder", ["/", "/deep/in/a folder/"])
def test_folder_shows_its_scene_wherever_it_is_served(page: Page, site: Site, scene: BakedScene, folder: str) -> None:
    glb = write_web_glb(scene)["scene.web.glb"]
    encoded = folder.replace(" ", "%20")
    site.files.update({f"{encoded}{name}": data for name, data in write_viewer_bundle(glb, title="A <b>").items()})
    asked: list[str] = []
    page.on("request", lambda request: asked.append(request.url))
    assert_shows(open_viewer(page, f"{site.url}{encoded}index.html"), glb)
    expect(page.locator("#name")).to_have_text("A <b>")
    assert {url.removeprefix(site.url) for url in asked if url.startswith("http")} <= set(site.files)


def test_single_file_shows_its_scene_from_disk_and_asks_for_nothing(
    page: Page, scene: BakedScene, tmp_path: Path
) -> None:
    glb = write_glb(scene)["scene.glb"]
    (tmp_path / "viewer.html").write_bytes(write_viewer_html(glb, title="Büste & Sockel")["viewer.html"])
    asked: list[str] = []
    page.on("request", lambda request: asked.append(request.url))
    page.goto((tmp_path / "viewer.html").as_uri())
    page.wait_for_function("window.polyfield")
    assert_shows(open_loaded(page), glb)
    expect(page).to_have_title("Büste & Sockel · Polyfield")
    assert [url for url in asked if not url.startswith(("blob:", "data:"))] == [(tmp_path / "viewer.html").as_uri()]


def test_bundle_has_no_way_back_to_a_service_that_is_not_there(page: Page, site: Site, scene: BakedScene) -> None:
    files = write_viewer_bundle(write_glb(scene)["scene.glb"])
    site.files.update({f"/bundle/{name}": data for name, data in files.items()})
    open_viewer(page, f"{site.url}/bundle/index.html")
    expect(page.locator('a[href="./"]')).to_have_count(0)


def open_loaded(page: Page) -> ViewerPage:
    page.evaluate("polyfield.ready")
    assert not page.locator("#message").is_visible()
    return ViewerPage(page)
