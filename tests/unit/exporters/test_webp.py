"""Lossless WebP keeps every byte, and is refused from its header when it is too large or of another kind."""

import io

import numpy as np
import pytest
from PIL import Image

from core.errors import AssetInvalid
from exporters.images import decode_image, decode_images, image_size
from exporters.png import encode_png
from exporters.webp import decode_webp, encode_webp, is_webp


@pytest.fixture
def image(rng: np.random.Generator) -> np.ndarray:
    pixels = rng.integers(0, 256, (31, 57, 4), dtype=np.uint8)
    pixels[:10, :, 3] = 0
    return pixels


@pytest.mark.parametrize("scene_texels", [0, 1 << 24, 1 << 26])
def test_every_byte_survives_whatever_alpha_says(image: np.ndarray, scene_texels: int) -> None:
    np.testing.assert_array_equal(decode_image(encode_webp(image, scene_texels=scene_texels), "image"), image)


def test_opaque_image_survives(image: np.ndarray) -> None:
    image[..., 3] = 255
    np.testing.assert_array_equal(decode_image(encode_webp(image), "image"), image)


def test_inexact_image_keeps_alpha_and_what_can_be_seen(image: np.ndarray) -> None:
    back = decode_image(encode_webp(image, exact=False), "image")
    np.testing.assert_array_equal(back[..., 3], image[..., 3])
    np.testing.assert_array_equal(back[image[..., 3] > 0], image[image[..., 3] > 0])


def test_size_is_in_the_header(image: np.ndarray) -> None:
    for file in (encode_webp(image), encode_png(image)):
        assert image_size(file, "image") == (31, 57)


def test_both_kinds_come_back_in_order(rng: np.random.Generator) -> None:
    images = [rng.integers(0, 256, (16, n, 4), dtype=np.uint8) for n in range(1, 7)]
    files = [encode_webp(each) if n % 2 else encode_png(each) for n, each in enumerate(images)]
    for each, back in zip(images, decode_images(files, "image"), strict=True):
        np.testing.assert_array_equal(back, each)


def test_lossy_file_is_refused(image: np.ndarray) -> None:
    file = io.BytesIO()
    Image.fromarray(image).save(file, "WEBP", quality=80)
    with pytest.raises(AssetInvalid, match="lossless"):
        decode_image(file.getvalue(), "image")


def test_huge_image_is_refused_from_its_header() -> None:
    file = bytearray(encode_webp(np.zeros((4, 4, 4), np.uint8)))
    file[21:25] = (10_000 - 1 | (10_000 - 1) << 14 | 1 << 28).to_bytes(4, "little")
    with pytest.raises(AssetInvalid, match="10000 x 10000"):
        decode_image(bytes(file), "image")


@pytest.mark.parametrize("length", [0, 10, 24, 40])
def test_truncated_file_is_refused(image: np.ndarray, length: int) -> None:
    with pytest.raises(AssetInvalid):
        decode_webp(encode_webp(image)[:length], "image")


def test_kinds_are_told_apart(image: np.ndarray) -> None:
    assert is_webp(encode_webp(image))
    assert not is_webp(encode_png(image))
