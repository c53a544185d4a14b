"""Lossless PNG of RGBA bytes, and its careful inverse."""

import io
import struct
import zlib
from collections.abc import Sequence

import numpy as np
from PIL import Image

from core.conventions import MAX_PAGE_SIZE_PX
from exporters.invalid import invalid
from exporters.threads import mapped

# (zlib level, strategy), tried on a band of each image. Pillow chooses each row's filter by the least sum of absolute
# differences, within 0.1 % of choosing by entropy. Measured on lego at 400 px, MB of features 0-3, 4-7 and colour:
# as trained, run length 5.53 5.69 4.86, Huffman alone 5.94 6.13 5.06, level 9 5.64 5.78 5.09: too noisy for strings;
# recoded for the web, run length 2.32 2.85 2.18, Huffman alone 2.25 2.99 2.10, level 9 2.51 3.29 2.13;
# for phones, run length 0.29 0.39 0.56, Huffman alone 0.32 0.38 0.52, level 9 0.26 0.40 0.52.
STRATEGIES = ((6, zlib.Z_RLE), (6, zlib.Z_HUFFMAN_ONLY), (9, zlib.Z_DEFAULT_STRATEGY))
BAND_TEXELS = 1 << 16  # an image of fewer is tried as a whole

_SIGNATURE = b"\x89PNG\r\n\x1a\n"
_HEADER = struct.Struct(">8sI4sIIBBBBB")
_RGBA = 6  # PNG colour type
# Pillow reports a broken PNG in any of these ways.
_DECODING_ERRORS = (
    Image.DecompressionBombError,
    EOFError,
    IndexError,
    KeyError,
    OSError,
    SyntaxError,
    ValueError,
    struct.error,
    zlib.error,
)


def encode_pngs(images: Sequence[np.ndarray]) -> list[bytes]:
    """PNG files of uint8 [height, width, 4] images, in order, several at a time (zlib works outside Python's lock)."""
    return mapped(encode_png, images)


def encode_png(image: np.ndarray) -> bytes:
    """A PNG file of a uint8 [height, width, 4] image; straight alpha, no colour profile; every byte is kept."""
    band = middle_band(image)
    tried = [(len(data), strategy, data) for strategy in STRATEGIES for data in [_encoded(band, *strategy)]]
    _, strategy, data = min(tried)
    return data if len(band) == len(image) else _encoded(image, *strategy)


def middle_band(image: np.ndarray) -> np.ndarray:
    """The rows that codings are tried on."""
    rows = max(1, BAND_TEXELS // image.shape[1])
    first = max(0, (len(image) - rows) // 2)
    return image[first : first + rows]


def _encoded(image: np.ndarray, level: int, strategy: int) -> bytes:
    file = io.BytesIO()
    Image.fromarray(np.ascontiguousarray(image)).save(file, "PNG", compress_level=level, compress_type=strategy)
    return file.getvalue()


def png_size(data: bytes, subject: str) -> tuple[int, int]:
    """(height, width) from a PNG's header alone.

    Raises:
        AssetInvalid: not a PNG of 8-bit RGBA, or larger than a page may be.
    """
    if len(data) < _HEADER.size:
        raise invalid(subject, "must be a PNG image", f"{len(data)} bytes")
    signature, _, kind, width, height, depth, color_type, *_ = _HEADER.unpack_from(data)
    if signature != _SIGNATURE or kind != b"IHDR":
        raise invalid(subject, "must be a PNG image", "something else")
    if (depth, color_type) != (8, _RGBA):
        raise invalid(subject, "must be 8-bit RGBA", f"colour type {color_type} with {depth} bits")
    if not (1 <= width <= MAX_PAGE_SIZE_PX and 1 <= height <= MAX_PAGE_SIZE_PX):
        raise invalid(subject, f"must have 1 to {MAX_PAGE_SIZE_PX} px a side", f"{width} x {height} px")
    return height, width


def decode_pngs(files: Sequence[bytes], subject: str) -> list[np.ndarray]:
    """What `decode_png` returns for each file, several at a time."""
    return mapped(lambda data: decode_png(data, subject), files)


def decode_png(data: bytes, subject: str) -> np.ndarray:
    """uint8 [height, width, 4] of a PNG file; its size is checked before anything is decoded.

    Raises:
        AssetInvalid
    """
    height, width = png_size(data, subject)
    try:
        with Image.open(io.BytesIO(data), formats=["PNG"]) as image:
            if image.size != (width, height):  # a second header
                raise ValueError("it states two sizes")
            pixels = np.array(image)
    except _DECODING_ERRORS as error:
        raise invalid(subject, "must be an intact PNG image", f"one that does not decode ({error})") from error
    if pixels.shape != (height, width, 4) or pixels.dtype != np.uint8:
        raise invalid(subject, "must be 8-bit RGBA", f"an image of shape {pixels.shape}")
    return pixels
