"""Decoding what strangers upload, and area averaging."""

import contextlib
import io
import struct
import zlib

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import Image

from core.errors import ImageTooLarge, ImageUndecodable, OptionInvalid
from core.images import MAX_PIXELS, area_resized, downscaled, read_image, read_size


def png_chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def oracle_area_resized(image_u8, size_px):
    """Every new pixel by two loops over the old ones, in float64."""
    height, width = image_u8.shape[:2]
    image = image_u8.astype(np.float64) / 255
    if image.shape[2] == 3:
        image = np.concatenate([image, np.ones_like(image[..., :1])], -1)
    image[..., :3] *= image[..., 3:]
    result = np.zeros((size_px[1], size_px[0], 4))
    for j, i in np.ndindex(size_px[1], size_px[0]):
        y0, y1 = j * height / size_px[1], (j + 1) * height / size_px[1]
        x0, x1 = i * width / size_px[0], (i + 1) * width / size_px[0]
        for y in range(int(y0), min(height, int(np.ceil(y1)))):
            for x in range(int(x0), min(width, int(np.ceil(x1)))):
                share = (min(y + 1, y1) - max(y, y0)) * (min(x + 1, x1) - max(x, x0))
                result[j, i] += share * image[y, x] / ((y1 - y0) * (x1 - x0))
    alpha = result[..., 3:]
    colour = np.where(alpha > 1e-9, result[..., :3] / np.maximum(alpha, 1e-9), 0)
    return colour, alpha[..., 0]


@pytest.mark.parametrize("mode", ["RGB", "RGBA", "L", "LA", "1"])
def test_every_mode_decodes_to_three_or_four_channels(tmp_path, mode):
    path = tmp_path / "photo.png"
    colour = Image.new("RGBA", (5, 3), (200, 100, 50, 255))
    colour.convert(mode).save(path)
    image = read_image(path)
    assert image.dtype == np.uint8
    assert image.shape == (3, 5, 4 if mode in ("RGBA", "LA") else 3)
    if mode in ("RGB", "RGBA"):
        assert (image[..., :3] == [200, 100, 50]).all()


def test_palette_with_transparency_has_alpha(tmp_path):
    path = tmp_path / "photo.png"
    image = Image.new("P", (2, 1))
    image.putpalette([255, 0, 0, 0, 255, 0])
    image.putdata([0, 1])
    image.save(path, transparency=1)
    assert read_image(path).tolist() == [[[255, 0, 0, 255], [0, 255, 0, 0]]]


def test_sixteen_bit_grey_is_rounded_to_eight(tmp_path):
    path = tmp_path / "photo.png"
    Image.fromarray(np.array([[0, 257, 385, 386, 65535]], np.uint16)).save(path)
    assert read_image(path)[0, :, 0].tolist() == [0, 1, 1, 2, 255]


@pytest.mark.parametrize("suffix", ["jpg", "webp"])
def test_jpeg_and_webp_decode(tmp_path, suffix):
    path = tmp_path / f"photo.{suffix}"
    Image.new("RGB", (16, 8), (120, 60, 30)).save(path, quality=95)
    assert read_size(path) == (16, 8)
    # Lossy formats keep a constant colour to within a few levels.
    np.testing.assert_allclose(read_image(path), np.broadcast_to([120, 60, 30], (8, 16, 3)), atol=4)


def test_exif_orientation_is_not_applied(tmp_path):
    path = tmp_path / "photo.jpg"
    exif = Image.Exif()
    exif[0x0112] = 6
    Image.new("RGB", (16, 8)).save(path, exif=exif)
    assert read_size(path) == (16, 8)
    assert read_image(path).shape == (8, 16, 3)


@pytest.mark.filterwarnings("ignore::PIL.Image.DecompressionBombWarning")
@pytest.mark.parametrize(("width", "height"), [(20_000, 20_000), (9_000, 9_000), (12_000, 12_000)])
def test_large_png_of_few_bytes_is_refused_from_its_header(tmp_path, width, height):
    path = tmp_path / "bomb.png"
    header = struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, 0)
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + png_chunk(b"IHDR", header) + png_chunk(b"IDAT", zlib.compress(b"")))
    for read in (read_size, read_image):
        with pytest.raises(ImageTooLarge, match=r"bomb\.png.*64 megapixels"):
            read(path)


def test_photo_at_the_limit_passes_the_header_check(tmp_path):
    path = tmp_path / "photo.png"
    header = struct.pack(">IIBBBBB", 8000, MAX_PIXELS // 8000, 8, 0, 0, 0, 0)
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + png_chunk(b"IHDR", header) + png_chunk(b"IDAT", zlib.compress(b"")))
    assert read_size(path) == (8000, MAX_PIXELS // 8000)


@pytest.mark.parametrize("content", [b"", b"this is a text file", b"GIF89a" + b"\0" * 20, b"\x89PNG\r\n\x1a\n"])
def test_what_is_no_image_is_refused_with_its_name(tmp_path, content):
    path = tmp_path / "holiday.png"
    path.write_bytes(content)
    for read in (read_size, read_image):
        with pytest.raises(ImageUndecodable, match=r"holiday\.png"):
            read(path)


@pytest.mark.parametrize("image_format", ["PNG", "JPEG", "WEBP"])
def test_truncated_photo_is_refused_when_decoded(tmp_path, image_format):
    data = io.BytesIO()
    noise = np.random.default_rng(0).integers(0, 256, (64, 64, 3), np.uint8)
    Image.fromarray(noise).save(data, image_format)
    path = tmp_path / "photo"
    path.write_bytes(data.getvalue()[: len(data.getvalue()) // 2])
    with pytest.raises(ImageUndecodable, match="photo"):
        read_image(path)


@settings(max_examples=60, deadline=None)
@given(st.data())
def test_flipped_bytes_never_raise_anything_else(tmp_path_factory, data):
    buffer = io.BytesIO()
    Image.fromarray(np.arange(8 * 8 * 4, dtype=np.uint8).reshape(8, 8, 4)).save(buffer, "PNG")
    content = bytearray(buffer.getvalue())
    for _ in range(data.draw(st.integers(1, 4))):
        content[data.draw(st.integers(0, len(content) - 1))] = data.draw(st.integers(0, 255))
    path = tmp_path_factory.mktemp("flipped") / "photo.png"
    path.write_bytes(content)
    with contextlib.suppress(ImageUndecodable, ImageTooLarge):
        read_image(path)


photos = st.tuples(st.integers(1, 13), st.integers(1, 13), st.sampled_from([3, 4]), st.integers(0, 2**32 - 1)).map(
    lambda case: np.random.default_rng(case[3]).integers(0, 256, (case[1], case[0], case[2]), np.uint8)
)


@settings(max_examples=50, deadline=None)
@given(photos, st.data())
def test_area_average_equals_the_oracle(image, data):
    size = data.draw(st.integers(1, image.shape[1])), data.draw(st.integers(1, image.shape[0]))
    result = area_resized(image, size)
    colour, alpha = oracle_area_resized(image, size)
    assert result.shape == (size[1], size[0], image.shape[2])
    if image.shape[2] == 4:
        # Half a level of rounding, and as much again where float64 sums fall on the other side of a tie.
        assert np.abs(result[..., 3] - alpha * 255).max() <= 0.5 + 1e-6
        colour = np.where(result[..., 3:] > 0, colour, 0)
    assert np.abs(result[..., :3] - colour * 255).max() <= 0.5 + 1e-6


def test_strips_do_not_show(monkeypatch):
    image = np.random.default_rng(1).integers(0, 256, (97, 61, 4), np.uint8)
    whole = area_resized(image, (23, 31))
    monkeypatch.setattr("core.images.STRIP_PIXELS", 400)
    # A strip may start a rounding error elsewhere: at most one level, where a mean is a tie.
    assert np.abs(area_resized(image, (23, 31)).astype(int) - whole).max() <= 1


@pytest.mark.parametrize("factor", [1, 1.5, 2, 3, 4.7])
@pytest.mark.parametrize("size", [(1, 1), (7, 5), (12, 9)])
def test_constant_photo_stays_constant(factor, size):
    image = np.full((size[1], size[0], 4), (201, 77, 3, 128), np.uint8)
    result = downscaled(image, factor)
    assert (result == image[:1, :1]).all()
    assert result.shape[0] >= 1
    assert result.shape[1] >= 1


def test_factor_one_is_identity():
    image = np.random.default_rng(2).integers(0, 256, (6, 5, 4), np.uint8)
    assert (downscaled(image, 1) == image).all()


def test_premultiplied_mean_is_preserved():
    image = np.random.default_rng(3).integers(0, 256, (40, 60, 4), np.uint8)
    result = downscaled(image, 2.5)

    def mean(photo):
        alpha = photo[..., 3:] / 255.0
        return np.concatenate([photo[..., :3] * alpha, photo[..., 3:]], -1).mean((0, 1))

    # Rounding errors of at most a level each are independent over 384 pixels: a twentieth of a level on average.
    np.testing.assert_allclose(mean(result), mean(image), atol=0.1)


def test_colours_of_transparent_pixels_do_not_bleed():
    image = np.zeros((2, 2, 4), np.uint8)
    image[...] = (0, 255, 0, 0)
    image[0, 0] = (255, 0, 0, 255)
    assert downscaled(image, 2).tolist() == [[[255, 0, 0, 64]]]


def test_fully_transparent_pixels_have_no_colour():
    image = np.full((4, 4, 4), (9, 8, 7, 0), np.uint8)
    assert not downscaled(image, 2).any()


@pytest.mark.parametrize("factor", [0.5, 0, -1, float("nan"), float("inf")])
def test_enlarging_is_refused(factor):
    with pytest.raises(OptionInvalid):
        downscaled(np.zeros((2, 2, 3), np.uint8), factor)
