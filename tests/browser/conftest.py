"""A browser and a site for the tests of the pages. All of them are skipped where Chromium or three.js is missing."""

from collections.abc import Iterator

import pytest
from playwright.sync_api import Browser, BrowserContext, Page, Playwright, sync_playwright

from core.baked import BakedScene
from exporters.gltf import write_glb
from tests.browser.chromium import launched, missing
from tests.browser.site import Site, running_site
from tests.browser.viewer import ViewerPage, collect_errors, open_viewer

# The layout of a laptop begins at 704 px; more pixels only take time in software.
LAPTOP = {"width": 800, "height": 480}


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


@pytest.fixture(scope="package")
def running() -> Iterator[Site]:
    with running_site() as instance:
        yield instance


@pytest.fixture
def site(running: Site) -> Iterator[Site]:
    """A site without files and API of its own yet."""
    yield running
    running.files.clear()
    running.api = None


@pytest.fixture(scope="package")
def context(browser: Browser) -> Iterator[BrowserContext]:
    instance = browser.new_context(viewport=LAPTOP)
    yield instance
    instance.close()


@pytest.fixture
def page(context: BrowserContext) -> Iterator[Page]:
    """A page in a laptop's layout. The test fails when the page throws, or logs an error or a warning."""
    instance = context.new_page()
    errors = collect_errors(instance)
    yield instance
    instance.close()
    assert errors == []


@pytest.fixture
def viewer(page: Page, site: Site, scene: BakedScene) -> ViewerPage:
    """The viewer with the hand-made scene on its stage."""
    return open_scene(page, site, scene)


def open_scene(page: Page, site: Site, scene: BakedScene) -> ViewerPage:
    """The viewer with `scene` on its stage."""
    site.files["/scene.glb"] = write_glb(scene)["scene.glb"]
    return open_viewer(page, f"{site.url}/viewer.html?src=/scene.glb")
