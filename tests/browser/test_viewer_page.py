"""The viewer's page as a person meets it."""

import json
import struct

import numpy as np
import pytest
from PIL import Image
from playwright.sync_api import Page, Playwright, expect

from core.baked import BakedScene
from exporters.gltf import write_glb
from tests.browser.chromium import NO_WEBGL, launched
from tests.browser.site import Site
from tests.browser.viewer import ViewerPage, canvas

PHONE = {"width": 390, "height": 844}


def test_viewer_starts_deferred_at_the_first_camera_with_its_figures(viewer: ViewerPage) -> None:
    page = viewer.page
    expect(page.get_by_role("radio", name="Deferred")).to_be_checked()
    expect(page.locator("#view")).to_have_value("0")
    expect(page.locator("#view option:checked")).to_have_text("front")
    expect(page.locator("#facts")).to_contain_text("96")
    expect(page.locator("#facts")).to_contain_text("128 × 64, 64 × 128")
    expect(page.locator("#pill")).to_contain_text("ms")


def test_all_three_modes_draw_the_object(viewer: ViewerPage) -> None:
    for mode in ("Deferred", "Forward", "Fallback"):
        viewer.page.locator("#modes label").filter(has_text=mode).click()
        viewer.page.evaluate("polyfield.stage.rendererOf(polyfield.stage.mode).load?.()")
        picture = canvas(viewer.page)
        assert (picture[..., :3] < 200).all(-1).mean() > 0.1, mode


def test_dragging_turns_the_object(viewer: ViewerPage) -> None:
    page = viewer.page
    before = page.evaluate("polyfield.stage.rig.camera.position.toArray()")
    page.mouse.move(400, 400)
    page.mouse.down()
    page.mouse.move(520, 430, steps=3)
    page.mouse.up()
    page.wait_for_function(
        "before => polyfield.stage.rig.camera.position.distanceTo({x: before[0], y: before[1], z: before[2]}) > 0.1",
        arg=before,
    )


def test_nothing_is_drawn_while_nothing_moves(viewer: ViewerPage) -> None:
    page = viewer.page
    page.evaluate("polyfield.stage.onFrame = () => (window.frames_drawn = (window.frames_drawn ?? 0) + 1)")
    still = "() => { const n = window.frames_drawn; window.frames_drawn = 0; return n === 0; }"
    page.wait_for_function(still, polling=700)  # first the frames that measure, then none at all
    page.evaluate("polyfield.stage.draw()")
    page.wait_for_function("window.frames_drawn === 1")


def test_view_picker_stands_where_the_photo_was_taken(viewer: ViewerPage, scene: BakedScene) -> None:
    page = viewer.page
    page.get_by_role("button", name="Next view").click()
    expect(page.locator("#view option:checked")).to_have_text("side")
    np.testing.assert_allclose(viewer.position(), scene.cameras[1].position, atol=1e-9)  # double precision


def test_transparent_background_leaves_the_canvas_transparent(viewer: ViewerPage) -> None:
    viewer.page.locator("#background").select_option("none")
    alpha = canvas(viewer.page)[..., 3]
    assert (alpha == 0).mean() > 0.2
    assert (alpha == 255).mean() > 0.2


def test_photos_background_arrives_byte_for_byte(viewer: ViewerPage) -> None:
    viewer.page.evaluate("polyfield.stage.setBackground([10 / 255, 100 / 255, 200 / 255])")
    assert tuple(canvas(viewer.page)[0, 0]) == (10, 100, 200, 255)


def test_save_picture_downloads_a_png(viewer: ViewerPage) -> None:
    with viewer.page.expect_download() as download:
        viewer.page.get_by_role("button", name="Save picture").click()
    assert download.value.suggested_filename == "scene.png"
    assert Image.open(download.value.path()).size == (480, 480)


def test_file_without_the_extension_is_shown_plainly_with_a_note(page: Page, site: Site, scene: BakedScene) -> None:
    site.files["/plain.glb"] = _without_extension(write_glb(scene)["scene.glb"])
    page.goto(f"{site.url}/viewer.html?src=/plain.glb")
    page.evaluate("polyfield.ready")
    expect(page.locator("#note")).to_contain_text("no neural material")
    expect(page.get_by_role("radio", name="Fallback")).to_be_checked()
    expect(page.get_by_role("radio", name="Deferred")).to_be_disabled()
    assert (canvas(page)[..., :3] < 200).all(-1).mean() > 0.1


def test_picked_file_is_shown(page: Page, site: Site, scene: BakedScene) -> None:
    page.goto(f"{site.url}/viewer.html")
    expect(page.locator("#message")).to_contain_text("Open an asset")
    glb = write_glb(scene)["scene.glb"]
    page.set_input_files("#pick-glb", {"name": "mine.glb", "mimeType": "model/gltf-binary", "buffer": glb})
    expect(page.locator("#name")).to_have_text("mine.glb")
    expect(page.locator("#message")).to_be_hidden()


@pytest.mark.parametrize("content", [b"", b"not a glb at all", b"glTF\x02\x00\x00\x00\xff\xff\xff\xff"])
def test_file_that_is_not_a_glb_is_refused_with_a_message(page: Page, site: Site, content: bytes) -> None:
    page.goto(f"{site.url}/viewer.html")
    page.evaluate("polyfield.ready")
    page.set_input_files("#pick-glb", {"name": "wrong.glb", "mimeType": "model/gltf-binary", "buffer": content})
    expect(page.locator("#message")).to_contain_text("cannot be shown")


def test_missing_webgl2_is_explained(playwright: Playwright, site: Site) -> None:
    with launched(playwright, NO_WEBGL) as browser:
        page = browser.new_page(viewport=PHONE)
        page.goto(f"{site.url}/viewer.html?src=/scene.glb")
        expect(page.locator("#message")).to_contain_text("WebGL2 is missing")
        expect(page.locator("#message-open")).to_be_hidden()
        expect(page.locator("#message-back")).to_be_visible()


def test_panel_leaves_a_phone_room_for_the_picture(viewer: ViewerPage) -> None:
    page = viewer.page
    page.set_viewport_size(PHONE)
    canvas, panel = page.locator("#canvas").bounding_box(), page.locator("#panel").bounding_box()
    assert canvas
    assert panel
    assert canvas["width"] == PHONE["width"]
    assert canvas["height"] >= 0.4 * PHONE["height"]
    assert panel["y"] >= canvas["y"] + canvas["height"] - 1


def _without_extension(glb: bytes) -> bytes:
    """The same file as any other tool would have written it."""
    (length,) = struct.unpack("<I", glb[12:16])
    text = json.loads(glb[20 : 20 + length])
    text["extensionsUsed"].remove("POLYFIELD_materials_neural")
    del text["extensions"]
    for mesh in text["meshes"]:
        for primitive in mesh["primitives"]:
            del primitive["extensions"]
    chunk = json.dumps(text).encode()
    chunk += b" " * (-len(chunk) % 4)
    rest = glb[20 + length :]
    return struct.pack("<4sIIII", b"glTF", 2, 20 + len(chunk) + len(rest), len(chunk), 0x4E4F534A) + chunk + rest
