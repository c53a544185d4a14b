"""The viewer works the same wherever an asset stands and however large it is, and starts within surroundings."""

from dataclasses import replace

import numpy as np
import pytest
from playwright.sync_api import Page

from core.baked import BakedScene
from core.camera import Camera
from core.conventions import ASSET_FROM_Z_UP
from tests.browser.conftest import open_scene
from tests.browser.site import Site
from tests.browser.viewer import ViewerPage, canvas
from tests.scenes import look_at_camera

# Rounding of the camera's place may move an edge by a texel's fraction: a few pixels of a picture, not jitter.
MOVED_PIXELS = 1e-3


def placed(scene: BakedScene, scale: float, distance: float) -> BakedScene:
    matrix = np.eye(4)
    matrix[:3, :3] *= scale
    matrix[:3, 3] = scale * distance * np.array([1.0, -0.5, 0.25])
    return replace(scene, asset_from_object=ASSET_FROM_Z_UP @ matrix, user_from_object=matrix)


def turned(viewer: ViewerPage) -> np.ndarray:
    """The picture after a drag and a turn of the wheel."""
    page = viewer.page
    page.mouse.move(200, 200)
    page.mouse.down()
    page.mouse.move(300, 230, steps=4)
    page.mouse.up()
    page.mouse.wheel(0, -240)
    page.wait_for_timeout(300)
    viewer.page.evaluate("for (let i = 0; i < 200; i += 1) polyfield.stage.rig.update()")  # damping comes to rest
    return canvas(viewer.page)


@pytest.fixture
def plain_pictures(page: Page, site: Site, scene: BakedScene) -> tuple[np.ndarray, np.ndarray]:
    """What the viewer shows at first, and after having been turned, of the scene where it was made."""
    viewer = open_scene(page, site, scene)
    return canvas(viewer.page), turned(viewer)


@pytest.mark.parametrize(("scale", "distance"), [(1e-6, 1e6), (1e6, 1e6)])
def test_place_and_size_of_an_asset_do_not_show(
    page: Page, site: Site, scene: BakedScene, plain_pictures: tuple, scale: float, distance: float
) -> None:
    viewer = open_scene(page, site, placed(scene, scale, distance))
    first = canvas(viewer.page)
    assert (first != plain_pictures[0]).any(-1).mean() < MOVED_PIXELS
    after = turned(viewer)
    assert (after != first).any(-1).mean() > 0.1
    # How far a drag turns depends on when its frames come; that it turns, and shows the object, does not.
    assert (after[..., :3] < 200).all(-1).mean() > 0.1


def test_camera_moves_by_tiny_steps_without_jitter(page: Page, site: Site, scene: BakedScene) -> None:
    viewer = open_scene(page, site, placed(scene, 1e6, 1e6))
    script = """() => {
      const { rig } = polyfield.stage;
      const { mesh } = polyfield.stage.gltf.neural.parts[0];
      return Array.from({ length: 50 }, () => {
        rig.camera.position.x += 1e-5;
        rig.camera.updateMatrixWorld(true);
        return mesh.modelViewMatrix.multiplyMatrices(rig.camera.matrixWorldInverse, mesh.matrixWorld).elements[12];
      });
    }"""
    steps = np.diff(page.evaluate(script))
    np.testing.assert_allclose(steps, steps.mean(), rtol=1e-4)  # doubles keep 1e-10 of the object's size
    assert abs(steps.mean()) > 1e-7
    assert canvas(viewer.page).any()


def test_scene_that_surrounds_its_cameras_starts_at_its_camera(page: Page, site: Site, scene: BakedScene) -> None:
    within = look_at_camera("within", (0.1, 0.3, 0.05), size_px=(160, 120))
    surrounding = replace(scene, cameras=(*scene.cameras, within), start_camera=3)
    viewer = open_scene(page, site, surrounding)
    assert page.locator("#view").input_value() == "3"
    np.testing.assert_allclose(viewer.position(), within.position, atol=1e-9)


@pytest.mark.parametrize("size_px", [(160, 90), (90, 160)])
def test_photo_of_surroundings_fills_the_canvas(
    page: Page, site: Site, scene: BakedScene, size_px: tuple[int, int]
) -> None:
    start = look_at_camera("start", (0.0, -0.3, 0.02), size_px=size_px)
    open_scene(page, site, replace(scene, cameras=(start,), start_camera=0))
    shown, photo = frustum(page), half_tangents(start)
    assert (shown <= photo * (1 + 1e-9)).all()
    assert np.isclose(shown, photo).any()


def test_orbit_turns_about_the_point_of_interest_on_the_axis(page: Page, site: Site, scene: BakedScene) -> None:
    start = look_at_camera("start", (0.6, -1.5, 0.2), size_px=(160, 120))
    viewer = open_scene(page, site, replace(placed(scene, 30.0, 7.0), cameras=(start,), start_camera=0))
    before = viewer.position()
    turned(viewer)
    assert np.linalg.norm(viewer.position() - before) > 0.05
    target = page.evaluate("polyfield.stage.rig.camera.getWorldDirection(polyfield.stage.rig.camera.position.clone())")
    right, forward = np.array([target["x"], target["y"], target["z"]]), -viewer.position()
    # The camera still looks at the origin of the object frame, which the asset's axes only turn.
    forward = ASSET_FROM_Z_UP[:3, :3] @ (forward / np.linalg.norm(forward))
    assert right @ forward > 0.98


def half_tangents(camera: Camera) -> np.ndarray:
    return np.array(camera.size_px) / 2 / np.array(camera.focal_px)


def frustum(page: Page) -> np.ndarray:
    """Tangents of half the angles that the canvas shows, in x and y."""
    page.evaluate("polyfield.stage.drawNow()")
    m = page.evaluate("polyfield.stage.rig.camera.projectionMatrix.elements")
    return np.array([1 / m[0], 1 / m[5]])
