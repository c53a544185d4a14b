"""The quick WebP coding: libwebp reads back every byte, and each part does what its readable oracle does."""

from itertools import pairwise

import numpy as np
import pytest

from exporters.vp8l import encode_vp8l
from exporters.vp8l.bits import MOST_BITS, BitStream
from exporters.vp8l.encoder import BAND_PX
from exporters.vp8l.prediction import BLACK, LEFT, MEAN_OF_FOUR, MEAN_OF_TWO, MODES, TOP, residuals
from exporters.vp8l.prefix_code import prefix_code
from exporters.webp import decode_webp, encode_webp, webp_size

SIZES = [(1, 1), (1, 9), (9, 1), (2, 2), (31, 57), (BAND_PX, 3), (BAND_PX + 1, BAND_PX + 1), (5, 2 * BAND_PX + 1)]


def noisy(rng: np.random.Generator, size: tuple[int, int]) -> np.ndarray:
    return rng.integers(0, 256, (*size, 4), dtype=np.uint8)


def flat(rng: np.random.Generator, size: tuple[int, int]) -> np.ndarray:
    return np.full((*size, 4), (3, 200, 77, 0), np.uint8)


def levels(rng: np.random.Generator, size: tuple[int, int]) -> np.ndarray:
    """Opaque, one channel of a single value, one of two, one of few."""
    values = rng.integers(0, 8, (*size, 4)) * (14, 0, 1, 0) + (0, 9, 0, 255)
    return values.astype(np.uint8)


def bell(rng: np.random.Generator, size: tuple[int, int]) -> np.ndarray:
    """Codes of very different lengths."""
    return np.clip(rng.normal(128, (1, 3, 20, 0.1), (*size, 4)), 0, 255).astype(np.uint8)


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("kind", [noisy, flat, levels, bell])
def test_every_byte_comes_back(rng: np.random.Generator, kind, size: tuple[int, int]) -> None:  # type: ignore[no-untyped-def]
    image = kind(rng, size)
    data = encode_vp8l(image)
    assert webp_size(data, "image") == size
    np.testing.assert_array_equal(decode_webp(data, "image"), image)


def test_view_of_some_channels_comes_back(rng: np.random.Generator) -> None:
    image = rng.integers(0, 256, (40, 50, 8), dtype=np.uint8)[..., 4:]
    np.testing.assert_array_equal(decode_webp(encode_vp8l(image), "image"), image)


def test_noise_takes_hardly_more_than_libwebp_makes_of_it(rng: np.random.Generator) -> None:
    image = np.clip(rng.normal(20, 2.0, (300, 300, 4)), 0, 255).astype(np.uint8)
    assert len(encode_vp8l(image)) < 1.05 * len(encode_webp(image, quick=True))


def test_pieces_lie_one_after_the_other_lowest_bit_first(rng: np.random.Generator) -> None:
    stream, written = BitStream(), ""
    for count in (1, 300, 0, 5, 64):
        lengths = rng.integers(0, MOST_BITS + 1, count)
        numbers = rng.integers(0, 1 << MOST_BITS, count, dtype=np.uint64) & (
            (np.uint64(1) << lengths.astype(np.uint64)) - np.uint64(1)
        )
        stream.put_all(numbers, lengths)
        stream.put(5, 3)
        pieces = [*zip(numbers.tolist(), lengths.tolist(), strict=True), (5, 3)]
        written += "".join(f"{number:0{length}b}"[::-1] if length else "" for number, length in pieces)
    written += "0" * (-len(written) % 8)
    assert stream.finish() == int(written[::-1], 2).to_bytes(len(written) // 8, "little")


@pytest.mark.parametrize("used", [64, 128, 63, 65])
def test_whole_words_are_ended_once(used: int) -> None:
    stream = BitStream()
    for _ in range(used):
        stream.put(1, 1)
    assert stream.finish() == ((1 << used) - 1).to_bytes(-(-used // 8), "little")


def test_prefix_codes_are_complete_and_no_code_begins_another(rng: np.random.Generator) -> None:
    code = prefix_code(rng.integers(0, 1000, 256) ** 3)
    used = np.flatnonzero(code.stated)
    assert sum(2.0 ** -code.stated[used]) == 1.0
    words = sorted(f"{int(code.codes[symbol]):0{code.lengths[symbol]}b}"[::-1] for symbol in used)
    assert not any(after.startswith(before) for before, after in pairwise(words))


@pytest.mark.parametrize("most", [7, 15])
def test_deep_trees_are_made_shallow(most: int) -> None:
    counts = np.ones(30, np.int64)
    for symbol in range(2, 30):
        counts[symbol] = counts[symbol - 1] + counts[symbol - 2]
    code = prefix_code(counts, most)
    assert code.stated.max() <= most
    assert sum(2.0**-code.stated) == 1.0


def test_only_symbol_takes_no_bits() -> None:
    code = prefix_code(np.array([0, 0, 7]))
    assert (code.stated[2], code.lengths[2], code.codes[2]) == (1, 0, 0)


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("size", [(1, 1), (1, 5), (5, 1), (4, 6)])
def test_residuals_are_those_of_the_specification(rng: np.random.Generator, mode: int, size: tuple[int, int]) -> None:
    image = noisy(rng, size)
    expected = np.array([[image[y, x] - predicted(image, y, x, mode) for x in range(size[1])] for y in range(size[0])])
    np.testing.assert_array_equal(residuals(image, None, mode), expected)
    if size[0] > 1:
        np.testing.assert_array_equal(residuals(image[1:], image[0], mode), expected[1:])


def predicted(image: np.ndarray, y: int, x: int, mode: int) -> np.ndarray:
    """RFC 9649, section 4.1, pixel by pixel."""
    before = image.reshape(-1, 4).astype(np.int64)
    at, width = y * image.shape[1] + x, image.shape[1]
    if at == 0:
        return np.array([0, 0, 0, 255], np.uint8)
    if y == 0 or x == 0:
        return image[y, x - 1] if y == 0 else image[y - 1, x]
    left, top, top_left, top_right = (before[at - back] for back in (1, width, width + 1, width - 1))
    of_mode = {
        BLACK: np.array([0, 0, 0, 255]),
        LEFT: left,
        TOP: top,
        MEAN_OF_TWO: (left + top) // 2,
        MEAN_OF_FOUR: ((left + top_left) // 2 + (top + top_right) // 2) // 2,
    }
    return of_mode[mode].astype(np.uint8)
