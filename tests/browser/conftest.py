"""A browser and a site for the tests of the pages. All of them are skipped where Chromium or three.js is missing."""

from collections.abc import Iterator

import pytest
from playwright.sync_api import Browser, Page, Playwright, sync_playwright

from core.baked import BakedScene
from exporters.gltf import write_glb
from tests.browser.chromium import launched, missing
from tests.browser.site import Site, running_site
from tests.browser.viewer import ViewerPage, collect_errors, open_viewer

LAPTOP = {"width": 1280, "height": 800}


# Package scope: Playwright keeps an event loop in this thread, in which tests of other packages could not start theirs.
@pytest.fixture(scope="package")
def playwright() -> Iterator[Playwright]:
    if reason := missing():
        pytest.skip(reason)
    with sync_playwright() as instance:
        yield instance


@pytest.fixture(scope="package")
def browser(playwright: Playwright) -> Iterator[Browser]:
    with launched(playwright) as instance:
        yield instance


@pytest.fixture
def site() -> Iterator[Site]:
    with running_site() as instance:
        yield instance


@pytest.fixture
def page(browser: Browser) -> Iterator[Page]:
    """A page of a laptop's size. The test fails when the page throws, or logs an error or a warning."""
    context = browser.new_context(viewport=LAPTOP)
    instance = context.new_page()
    errors = collect_errors(instance)
    yield instance
    context.close()
    assert errors == []


@pytest.fixture
def viewer(page: Page, site: Site, scene: BakedScene) -> ViewerPage:
    """The viewer with the hand-made scene on its stage."""
    return open_scene(page, site, scene)


def open_scene(page: Page, site: Site, scene: BakedScene) -> ViewerPage:
    """The viewer with `scene` on its stage."""
    site.files["/scene.glb"] = write_glb(scene)["scene.glb"]
    return open_viewer(page, f"{site.url}/viewer.html?src=/scene.glb")
