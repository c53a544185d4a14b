"""Starting a headless Chromium with, or without, WebGL2."""

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from ctypes.util import find_library
from pathlib import Path

from playwright.sync_api import Browser, Playwright, sync_playwright

THREE = Path(__file__).resolve().parents[2] / "viewer_static" / "node_modules" / "three"
QUIET = (
    "--no-sandbox",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--mute-audio",
)
# The system's OpenGL, which without a graphics processor is Mesa's llvmpipe. Chromium's own software renderer needs
# no library, but snaps vertices to 1/16 px where llvmpipe keeps 1/256, and so flips ten times as many pixels.
WEBGL = ("--use-gl=angle", "--use-angle=gl-egl", "--ignore-gpu-blocklist")
NO_WEBGL = ("--disable-gpu", "--disable-software-rasterizer", "--disable-3d-apis")


def missing() -> str:
    """What is missing for browser tests, with the remedy; empty when nothing is."""
    if executable() is None:
        return "no Chromium found (install the `chromium` package)"
    if find_library("EGL") is None:
        return "no EGL found, which WebGL2 is run on (install the `libegl1` and `libgl1` packages)"
    if not THREE.is_dir():
        return "three.js is not installed (run `npm ci` in viewer_static)"
    return ""


def executable() -> str | None:
    """Path of the installed Chromium or Chrome."""
    names = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
    return next((found for name in names if (found := shutil.which(name))), None)


@contextmanager
def launched(playwright: Playwright, flags: tuple[str, ...] = WEBGL) -> Iterator[Browser]:
    """A headless browser that ends with the block."""
    browser = playwright.chromium.launch(executable_path=executable(), args=[*QUIET, *flags])
    try:
        yield browser
    finally:
        browser.close()


@contextmanager
def running_browser(flags: tuple[str, ...] = WEBGL) -> Iterator[Browser]:
    """A headless browser with a Playwright of its own, of which a thread may have only one."""
    with sync_playwright() as playwright, launched(playwright, flags) as browser:
        yield browser
