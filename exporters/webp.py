"""Lossless WebP of RGBA bytes, and its careful inverse."""

import io
import struct

import numpy as np
from PIL import Image

from core.conventions import MAX_PAGE_SIZE_PX
from exporters.invalid import invalid

# Measured on lego at 400 px for the web, three images of 2048², one core: method 0 quality 0 takes 0.8 s for 15.8 MB,
# 1 and 0 2.2 s for 13.7, 2 and 40 3.3 s for 13.0, 4 and 50 3.8 s for 12.9; 6 and 100 ten times as long for a percent.
# Pages of large scenes take longer than people wait for some percent. On a page of benchmarks/big_scene.py, s and MB:
# 2 and 40 14.1 s 44.9 MB; 3 and 0 7.2 s 45.8 MB; 1 and 0 6.6 s 46.0 MB; 0 and 0 3.5 s 53.3 MB.
EFFORTS = (  # texels of a scene's pages, up to which; method and quality
    (1 << 23, 2, 40),  # half of a page of 4096²
    (1 << 25, 1, 0),  # two
    (1 << 63, 0, 0),
)

_SIGNATURE = struct.Struct("<4sI4s4sIBI")  # RIFF, length, WEBP, VP8L, length, 0x2f, sizes
_ONE_BYTE_MARK = 0x2F
_DECODING_ERRORS = (Image.DecompressionBombError, EOFError, OSError, SyntaxError, ValueError, struct.error)


def is_webp(data: bytes) -> bool:
    """Whether the file says that it is one."""
    return data[:4] == b"RIFF" and data[8:12] == b"WEBP"


def encode_webp(image: np.ndarray, *, exact: bool = True, scene_texels: int = 0) -> bytes:
    """A lossless WebP file of a uint8 [height, width, 4] image, straight alpha, no colour profile.

    Args:
        exact: every byte is kept. Without, colours under alpha 0 become what compresses best.
        scene_texels: of all the scene's pages together: the more, the less effort goes into each (`EFFORTS`).
    """
    file = io.BytesIO()
    method, quality = next(effort for most, *effort in EFFORTS if scene_texels <= most)
    pixels = Image.fromarray(np.ascontiguousarray(image))
    pixels.save(file, "WEBP", lossless=True, exact=exact, method=method, quality=quality)
    return file.getvalue()


def webp_size(data: bytes, subject: str) -> tuple[int, int]:
    """(height, width) from the header alone.

    Raises:
        AssetInvalid: not a plain lossless WebP (no animation, no metadata), or larger than a page may be.
    """
    if len(data) < _SIGNATURE.size:
        raise invalid(subject, "must be a WebP image", f"{len(data)} bytes")
    riff, _, webp, kind, _, mark, sizes = _SIGNATURE.unpack_from(data)
    if (riff, webp, kind, mark) != (b"RIFF", b"WEBP", b"VP8L", _ONE_BYTE_MARK):
        raise invalid(subject, "must be a lossless WebP image", f"a chunk {kind!r}")
    width, height = 1 + (sizes & 0x3FFF), 1 + (sizes >> 14 & 0x3FFF)
    if not (width <= MAX_PAGE_SIZE_PX and height <= MAX_PAGE_SIZE_PX):
        raise invalid(subject, f"must have 1 to {MAX_PAGE_SIZE_PX} px a side", f"{width} x {height} px")
    return height, width


def decode_webp(data: bytes, subject: str) -> np.ndarray:
    """uint8 [height, width, 4]; its size is checked before anything is decoded.

    Raises:
        AssetInvalid
    """
    height, width = webp_size(data, subject)
    try:
        with Image.open(io.BytesIO(data), formats=["WEBP"]) as image:
            if image.size != (width, height):
                raise ValueError("it states two sizes")
            pixels = np.array(image.convert("RGBA"))  # opaque ones come without alpha
    except _DECODING_ERRORS as error:
        raise invalid(subject, "must be an intact WebP image", f"one that does not decode ({error})") from error
    return pixels
