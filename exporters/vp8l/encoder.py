"""VP8L (RFC 9649) with what pays on large pages of noisy texels: a predictor and prefix codes for each band of rows.

No references back to earlier pixels, no colour cache, no colour transform: libwebp's search for these and among
predictors takes most of its time. Here all is arithmetic on arrays.

Measured on a page of benchmarks/big_scene.py, features 0-3, 4-7 and colour, MB: 12.06 19.82 20.84 in 0.3 to 0.6 s;
libwebp's method 1 8.17 18.39 19.43 in 1.6 to 2.8 s, its method 0 9.02 22.34 21.91 in 1.0 to 1.4 s. Without references
and a cache, quiet channels take a bit each: such images, and most of lego_100's (a sixth to a third larger here), stay
with libwebp (`exporters.gltf.compressed`). Subtracting green made colours larger: 5.2 for 4.7 MB a quarter page.
"""

import struct
from collections.abc import Iterator, Sequence

import numpy as np

from exporters.vp8l.bits import BitStream
from exporters.vp8l.prediction import MODES, residuals
from exporters.vp8l.prefix_code import PrefixCode, prefix_code, write_prefix_code

BAND_BITS = 8  # 256 rows; with 512, the most that VP8L has, a page of lego_100 takes 15 % more, with 64 4 % less
BAND_PX = 1 << BAND_BITS
TRIED_ROWS = 16  # of a band, to choose its predictor
PIXELS_AT_ONCE = 1 << 16  # 0.5 MB a step: stays in the cache
LITERALS, REFERENCES, DISTANCES = 256, 24, 40  # of alphabets; green's has the lengths of references, too
_SIGNATURE = 0x2F
_LENGTH_SHIFT, _CODE = np.uint64(32), np.uint64(0xFFFFFFFF)  # where a table keeps a piece's length, and the piece
Codes = tuple[PrefixCode, ...]  # of red, green, blue and alpha


def encode_vp8l(image: np.ndarray) -> bytes:
    """A lossless WebP file of a uint8 [height, width, 4] image, straight alpha; every byte is kept."""
    rest = np.empty(image.shape, np.uint8)  # what predictors leave
    bands = [slice(first, min(first + BAND_PX, len(image))) for first in range(0, len(image), BAND_PX)]
    modes = [_best_mode(image[band]) for band in bands]
    codes = [_predicted(image, band, mode, rest) for band, mode in zip(bands, modes, strict=True)]
    stream = BitStream()
    _write_head(stream, image, modes, codes)
    for band, of_band in zip(bands, codes, strict=True):
        tables = _tables(of_band)
        for rows in _steps(image, band):
            stream.put_all(*_pieces(rest[rows].reshape(-1, 4), *tables))
    return _file(stream.finish())


def _predicted(image: np.ndarray, band: slice, mode: int, rest: np.ndarray) -> Codes:
    """Fills the band's rows of `rest`; returns the codes that suit it."""
    counts = np.zeros((4, LITERALS), np.int64)
    for rows in _steps(image, band):
        above = image[rows.start - 1] if rows.start else None
        rest[rows] = residuals(np.ascontiguousarray(image[rows]), above, mode)
        counts += _counts(rest[rows])
    return tuple(map(prefix_code, counts))


def _steps(image: np.ndarray, band: slice) -> Iterator[slice]:
    """The band's rows, about PIXELS_AT_ONCE at a time."""
    count = max(1, PIXELS_AT_ONCE // image.shape[1])
    return (slice(first, min(first + count, band.stop)) for first in range(band.start, band.stop, count))


def _file(data: bytes) -> bytes:
    padded = data + bytes(len(data) % 2)
    return struct.pack("<4sI4s4sI", b"RIFF", 12 + len(padded), b"WEBP", b"VP8L", len(data)) + padded


def _write_head(stream: BitStream, image: np.ndarray, modes: Sequence[int], codes: Sequence[Codes]) -> None:
    """All that comes before the pixels."""
    height, width = image.shape[:2]
    blocks = -(-width // BAND_PX)
    stream.put(_SIGNATURE, 8)
    stream.put(width - 1, 14)
    stream.put(height - 1, 14)
    stream.put(int((image[..., 3] < 255).any()), 1)
    stream.put(0, 3)  # version
    stream.put(0b001, 3)  # a transform: that by predictors
    stream.put(BAND_BITS - 2, 3)
    _write_greens(stream, [mode for mode in modes for _ in range(blocks)])
    stream.put(0, 1)  # no more transforms
    stream.put(0, 1)  # no colour cache
    stream.put(int(len(codes) > 1), 1)
    if len(codes) > 1:
        stream.put(BAND_BITS - 2, 3)
        _write_greens(stream, [band for band in range(len(codes)) for _ in range(blocks)])
    for of_band in codes:
        _write_codes(stream, of_band)


def _write_greens(stream: BitStream, values: list[int]) -> None:
    """An image within the image, of which only green counts."""
    nothing = prefix_code(np.eye(1, LITERALS, dtype=np.int64)[0])
    green = prefix_code(np.bincount(values, minlength=LITERALS))
    stream.put(0, 1)  # no colour cache
    _write_codes(stream, (nothing, green, nothing, nothing))
    for value in values:
        stream.put(int(green.codes[value]), int(green.lengths[value]))


def _write_codes(stream: BitStream, codes: Codes) -> None:
    red, green, blue, alpha = codes
    for code, more in ((green, REFERENCES), (red, 0), (blue, 0), (alpha, 0)):
        write_prefix_code(stream, code, LITERALS + more)
    write_prefix_code(stream, prefix_code(np.eye(1, DISTANCES, dtype=np.int64)[0]), DISTANCES)


def _best_mode(band: np.ndarray) -> int:
    """The predictor that takes fewest bits on some of the rows."""
    first = max(0, (len(band) - TRIED_ROWS - 1) // 2)
    above, *_ = rows = np.ascontiguousarray(band[first : first + TRIED_ROWS + 1])
    if len(rows) == 1:
        return MODES[0]

    def bits(mode: int) -> int:
        counts = _counts(residuals(rows[1:], above, mode))
        return sum(int((prefix_code(of_channel).lengths * of_channel).sum()) for of_channel in counts)

    return min(MODES, key=bits)


def _counts(rest: np.ndarray) -> np.ndarray:
    """int64 [4, 256] of bytes [h, w, 4]: how often each occurs. Two channels are counted at once."""
    pairs = rest.view("<u2")
    both = [np.bincount(pairs[..., k].ravel(), minlength=1 << 16).reshape(LITERALS, LITERALS) for k in (0, 1)]
    return np.stack([both[0].sum(0), both[0].sum(1), both[1].sum(0), both[1].sum(1)])


def _tables(codes: Codes) -> tuple[np.ndarray, np.ndarray]:
    """uint64 [256, 256] twice: the piece that green and red take, by [green, red], and that of blue and alpha, by
    [alpha, blue], with its length from bit 32 on."""
    red, green, blue, alpha = codes
    return (
        _joined(_with_lengths(green)[:, None], _with_lengths(red)[None]),
        _joined(_with_lengths(blue)[None], _with_lengths(alpha)[:, None]),
    )


def _with_lengths(code: PrefixCode) -> np.ndarray:
    return code.codes | code.lengths.astype(np.uint64) << _LENGTH_SHIFT


def _joined(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Pieces with lengths as one, `first` in the lower bits. Their sum adds the lengths."""
    length = first >> _LENGTH_SHIFT
    shifted = (second & _CODE) << length
    return (first + (second - (second & _CODE))) | shifted


def _pieces(pixels: np.ndarray, green_red: np.ndarray, blue_alpha: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(uint64 [n], int64 [n]): each pixel's codes as one piece, and its length."""
    pairs = pixels.view("<u2")
    first, second = green_red.ravel().take(pairs[:, 0]), blue_alpha.ravel().take(pairs[:, 1])
    length = first >> _LENGTH_SHIFT
    numbers = (first & _CODE) | (second & _CODE) << length
    return numbers, (length + (second >> _LENGTH_SHIFT)).astype(np.int64)
