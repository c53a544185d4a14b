"""Pictures for people."""

import io

import numpy as np
from PIL import Image

from core.baked import BakedScene
from core.camera import Camera
from core.capture import Capture, View
from core.render.composite import over, quantised
from core.render.raster import Rasteriser

SIDE_PX = 512  # small photos still make a picture worth looking at


def png_bytes(image_u8: np.ndarray) -> bytes:
    """A PNG of an image [height, width, 3 or 4] uint8, sRGB."""
    buffer = io.BytesIO()
    Image.fromarray(np.ascontiguousarray(image_u8)).save(buffer, "PNG")
    return buffer.getvalue()


def preview(scene: BakedScene, capture: Capture, device: str) -> np.ndarray:
    """The scene from the held-out (else training) camera that sees most of it, anti-aliased: [h, w, 3] uint8."""
    view = max(capture.test or capture.train, key=_shown)
    image = Rasteriser(scene, device).deferred(_sized(view.camera))
    return quantised(over(image, scene.background))


def _shown(view: View) -> float:
    return float(view.premultiplied()[1].mean())


def _sized(camera: Camera) -> Camera:
    """The camera with a longest side of `SIDE_PX`."""
    width, height = camera.size_px
    scale = SIDE_PX / max(width, height)
    size_px = (max(1, round(width * scale)), max(1, round(height * scale)))
    return camera.resized(size_px)
