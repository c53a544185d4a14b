"""PNG files keep every byte, and are refused from their header when they are too large or of another kind."""

import io
import struct
import zlib

import numpy as np
import pytest
from PIL import Image

from core.errors import AssetInvalid
from exporters.png import decode_png, encode_png, encode_pngs

SIGNATURE = b"\x89PNG\r\n\x1a\n"


def header_chunk(width: int, height: int) -> bytes:
    """IHDR of an 8-bit RGBA image."""
    chunk = b"IHDR" + struct.pack(">IIBBBBB", width, height, 8, 6, 0, 0, 0)
    return struct.pack(">I", 13) + chunk + struct.pack(">I", zlib.crc32(chunk))


def test_every_byte_survives_whatever_alpha_says(rng: np.random.Generator) -> None:
    image = rng.integers(0, 256, (31, 57, 4), dtype=np.uint8)
    image[:10, :, 3] = 0
    np.testing.assert_array_equal(decode_png(encode_png(image), "image"), image)


def test_images_come_back_in_order(rng: np.random.Generator) -> None:
    images = [rng.integers(0, 256, (64, n, 4), dtype=np.uint8) for n in range(1, 9)]
    for image, png in zip(images, encode_pngs(images), strict=True):
        np.testing.assert_array_equal(decode_png(png, "image"), image)


def test_png_carries_no_colour_profile_or_gamma() -> None:
    png = encode_png(np.zeros((4, 4, 4), np.uint8))
    assert not any(kind in png for kind in (b"iCCP", b"sRGB", b"gAMA", b"cHRM"))


def test_huge_image_is_refused_from_its_header() -> None:
    with pytest.raises(AssetInvalid, match="20000 x 20000"):
        decode_png(SIGNATURE + header_chunk(20_000, 20_000), "image")


@pytest.mark.filterwarnings("ignore::PIL.Image.DecompressionBombWarning")  # Pillow's own, at the smaller size
@pytest.mark.parametrize("side", [10_000, 60_000])
def test_huge_image_behind_a_small_header_is_refused(side: int) -> None:
    png = encode_png(np.zeros((4, 4, 4), np.uint8))
    first = SIGNATURE + header_chunk(4, 4)
    assert png.startswith(first)
    with pytest.raises(AssetInvalid, match="intact"):
        decode_png(first + header_chunk(side, side) + png[len(first) :], "image")


@pytest.mark.parametrize("mode", ["L", "RGB", "P", "I;16"])
def test_other_kinds_of_png_are_refused(mode: str) -> None:
    file = io.BytesIO()
    Image.new(mode, (4, 4)).save(file, "PNG")
    with pytest.raises(AssetInvalid, match="8-bit RGBA"):
        decode_png(file.getvalue(), "image")


@pytest.mark.parametrize("data", [b"", b"GIF89a", b"plain text, but long enough to hold a header of a PNG"])
def test_other_files_are_refused(data: bytes) -> None:
    with pytest.raises(AssetInvalid, match="PNG"):
        decode_png(data, "image")


def test_truncated_png_is_refused(rng: np.random.Generator) -> None:
    png = encode_png(rng.integers(0, 256, (64, 64, 4), dtype=np.uint8))
    with pytest.raises(AssetInvalid, match="intact"):
        decode_png(png[: len(png) // 2], "image")
