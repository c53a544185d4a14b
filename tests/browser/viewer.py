"""Driving the viewer's page: pixels out of `window.polyfield`."""

import base64
import io
from dataclasses import dataclass
from typing import Any

import numpy as np
from PIL import Image
from playwright.sync_api import Page

from core.camera import Camera

# Bytes cross from the page as base64: a list of numbers takes seconds for a picture.
TO_BASE64 = """
const toBase64 = (bytes) => {
  let text = "";
  for (let i = 0; i < bytes.length; i += 32768) text += String.fromCharCode(...bytes.subarray(i, i + 32768));
  return btoa(text);
};
"""


@dataclass(frozen=True)
class ViewerPage:
    """The viewer with an asset on its stage."""

    page: Page

    def render(self, view: int | Camera, mode: str, size_px: tuple[int, int]) -> np.ndarray:
        """[height, width, 4] float64 in [0, 1], premultiplied by coverage.

        Args:
            view: index among the asset's views, or a camera in the object frame.
            mode: deferred, forward or plain.
            size_px: (width, height).
        """
        width, height = size_px
        which = view if isinstance(view, int) else _as_view(view)
        script = f"async ([view, mode, width, height]) => {{ {TO_BASE64} return toBase64(\
await polyfield.renderToPixels(view, mode, width, height)); }}"
        data = self.page.evaluate(script, [which, mode, width, height])
        return _bytes(data).reshape(height, width, 4) / 255.0

    def position(self) -> np.ndarray:
        """[3]: where the person's camera is, in the object frame."""
        script = "polyfield.stage.gltf.neural.parts[0].mesh.worldToLocal(polyfield.stage.rig.camera.position.clone())"
        return np.array(self.page.evaluate(f"{script}.toArray()"))

    def feature_texture(self, page: int, half: int) -> np.ndarray:
        """[height, width, 4] uint8 as the graphics processor has it: features 0 to 3 (half 0) or 4 to 7 (half 1)."""
        script = f"([page, half]) => {{ {TO_BASE64} const t = polyfield.readFeatureTexture(page, half); \
return [t.width, t.height, toBase64(t.bytes)]; }}"
        width, height, data = self.page.evaluate(script, [page, half])
        return _bytes(data).reshape(height, width, 4)


def open_viewer(page: Page, address: str) -> ViewerPage:
    """Opens the viewer at `address` and waits until its asset is shown.

    Raises:
        RuntimeError: the viewer shows a message instead, or the page threw an error.
    """
    errors = collect_errors(page)
    page.goto(address)
    page.evaluate("polyfield.ready")
    if page.locator("#message").is_visible():
        raise RuntimeError(f"the viewer says: {page.locator('#message').inner_text()}")
    if errors:
        raise RuntimeError("; ".join(errors))
    return ViewerPage(page)


def canvas(page: Page) -> np.ndarray:
    """[h, w, 4] uint8: what the canvas shows now, straight alpha."""
    page.evaluate("polyfield.stage.drawNow(); window.picture = document.getElementById('canvas').toDataURL()")
    png = base64.b64decode(page.evaluate("picture").split(",")[1])
    return np.asarray(Image.open(io.BytesIO(png)).convert("RGBA"))


def collect_errors(page: Page) -> list[str]:
    """A list that fills with the page's errors and console errors and warnings from now on."""
    errors: list[str] = []
    page.on("pageerror", lambda error: errors.append(str(error)))

    def on_console(message: Any) -> None:
        # Software rendering makes Chromium warn about slow read-backs.
        if message.type in ("error", "warning") and "GPU stall" not in message.text:
            errors.append(message.text)

    page.on("console", on_console)
    return errors


def _as_view(camera: Camera) -> dict[str, Any]:
    """A camera as the asset's extension describes it."""
    return {
        "imageSize": list(camera.size_px),
        "focalLength": list(camera.focal_px),
        "principalPoint": list(camera.centre_px),
        "objectFromCamera": camera.world_from_camera.T.ravel().tolist(),
    }


def _bytes(data: str) -> np.ndarray:
    return np.frombuffer(base64.b64decode(data), np.uint8)
