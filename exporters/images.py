"""Image files of the kinds that assets may hold: PNG and lossless WebP."""

from collections.abc import Sequence

import numpy as np

from exporters.png import decode_png, png_size
from exporters.threads import mapped
from exporters.webp import decode_webp, is_webp, webp_size


def image_size(data: bytes, subject: str) -> tuple[int, int]:
    """(height, width) from the header alone.

    Raises:
        AssetInvalid: neither 8-bit RGBA PNG nor lossless WebP, or larger than a page may be.
    """
    return webp_size(data, subject) if is_webp(data) else png_size(data, subject)


def decode_image(data: bytes, subject: str) -> np.ndarray:
    """uint8 [height, width, 4].

    Raises:
        AssetInvalid
    """
    return decode_webp(data, subject) if is_webp(data) else decode_png(data, subject)


def decode_images(files: Sequence[bytes], subject: str) -> list[np.ndarray]:
    """What `decode_image` returns for each file, several at a time (codecs work outside Python's lock)."""
    return mapped(lambda data: decode_image(data, subject), files)
