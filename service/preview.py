"""Pictures for people."""

import io

import numpy as np
from PIL import Image


def png_bytes(image_u8: np.ndarray) -> bytes:
    """A PNG of an image [height, width, 3 or 4] uint8, sRGB."""
    buffer = io.BytesIO()
    Image.fromarray(np.ascontiguousarray(image_u8)).save(buffer, "PNG")
    return buffer.getvalue()


def over_background(premultiplied: np.ndarray, background: tuple[float, float, float]) -> np.ndarray:
    """A render [h, w, 4], premultiplied, over a background (sRGB, [0, 1]): [h, w, 3] uint8."""
    color = premultiplied[..., :3] + (1.0 - premultiplied[..., 3:]) * np.asarray(background)
    return np.rint(np.clip(color, 0.0, 1.0) * 255.0).astype(np.uint8)
