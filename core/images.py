"""Photos as arrays: decoding what strangers upload, and area averaging.

EXIF orientation is *not* applied. Poses refer to the pixels as they are stored: instant-ngp, nerfstudio and COLMAP all
read the stored pixels, and a pose file made by them would no longer fit photos that were turned upright here. A photo
whose stored size contradicts its pose file is refused (`ImageSizeMismatch`), so no turned photo is trained silently.
Colour profiles are not applied either: the network reproduces the stored sRGB values (core/conventions.py).
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
from PIL import Image, UnidentifiedImageError

from core.errors import ImageTooLarge, ImageUndecodable, OptionInvalid

FORMATS = ("PNG", "JPEG", "WEBP")  # the decoders that may run at all; Pillow has dozens, some of them old and fragile
SUFFIXES = (".png", ".jpg", ".jpeg", ".webp")

# A phone's largest ordinary photo has 50 megapixels. 64 of them decode to 256 MB of RGBA, which two threads can afford;
# a 20,000 x 20,000 PNG of a few kB would take 1.6 GB.
MAX_PIXELS = 64_000_000

# Area averaging works on strips of about this many source pixels, so that float64 sums of a large photo stay small.
STRIP_PIXELS = 1 << 19


def read_size(path: Path, name: str | None = None) -> tuple[int, int]:
    """(width, height) of a photo from its header; no pixel is decoded.

    Args:
        name: what the user calls the photo; its file name by default.

    Raises:
        ImageUndecodable, ImageTooLarge
    """
    with _opened(path, name or path.name) as image:
        return image.size


def read_image(path: Path, name: str | None = None) -> np.ndarray:
    """A photo [height, width, 3 or 4] uint8, sRGB, straight alpha; four channels where the file has transparency.

    Grey becomes three equal channels, palettes their colours, and 16 bits are rounded to 8.

    Raises:
        ImageUndecodable, ImageTooLarge
    """
    name = name or path.name
    with _opened(path, name) as image:
        try:
            return _as_rgb_or_rgba(image)
        except MemoryError:
            raise
        except Exception as error:  # decoders raise OSError, SyntaxError, ValueError, struct.error ... on hostile bytes
            raise _undecodable(name, str(error)) from error


def read_reduced(path: Path, max_side_px: int, name: str | None = None) -> np.ndarray:
    """A photo as `read_image` gives it, with a longest side of at most `max_side_px`: to look at, not to train on.

    JPEGs are made smaller while they are decoded, which takes a fraction of the time and memory.

    Raises:
        ImageUndecodable, ImageTooLarge
    """
    name = name or path.name
    with _opened(path, name) as image:
        width, height = image.size
        scale = min(1.0, max_side_px / max(width, height))
        size = max(1, round(width * scale)), max(1, round(height * scale))
        try:
            image.draft("RGB", size)
            # Premultiplied, so that transparent pixels lend no colour to their neighbours.
            small = _for_resizing(image).resize(size, Image.Resampling.BOX)
            return np.array(small.convert("RGBA") if small.mode == "RGBa" else small)
        except MemoryError:
            raise
        except Exception as error:
            raise _undecodable(name, str(error)) from error


def read_exif(path: Path, name: str | None = None) -> Image.Exif:
    """What the camera wrote about a photo; empty where it wrote nothing, or nothing that can be read.

    Raises:
        ImageUndecodable, ImageTooLarge
    """
    with _opened(path, name or path.name) as image:
        try:
            return image.getexif()
        except Exception:  # parsers raise anything on hostile bytes
            return Image.Exif()


@contextmanager
def _opened(path: Path, name: str) -> Iterator[Image.Image]:
    try:
        image = Image.open(path, formats=FORMATS)
    except (Image.DecompressionBombError, Image.DecompressionBombWarning) as error:
        raise _too_large(name, "far more") from error
    except UnidentifiedImageError as error:
        empty = path.stat().st_size == 0
        raise _undecodable(name, "an empty file" if empty else "a file that is none of them") from error
    except Exception as error:
        raise _undecodable(name, str(error) or type(error).__name__) from error
    with image:
        width, height = image.size
        if width * height > MAX_PIXELS:
            raise _too_large(name, f"{width} x {height} px")
        yield image


def _too_large(name: str, received: str) -> ImageTooLarge:
    return ImageTooLarge(
        f"photo {name}",
        f"at most {MAX_PIXELS // 1_000_000} megapixels are decoded",
        received,
        "Scale the photo down; 800 to 2000 px a side give a good result.",
    )


def _undecodable(name: str, reason: str) -> ImageUndecodable:
    return ImageUndecodable(
        f"photo {name}",
        "must be a complete PNG, JPEG or WebP image",
        reason,
        "Open it in a photo viewer; export or upload it again if it does not show there.",
    )


def _as_rgb_or_rgba(image: Image.Image) -> np.ndarray:
    if image.mode.startswith("I"):  # 16-bit grey
        grey = np.rint(np.clip(np.asarray(image, np.float64), 0, 65535) / 257.0).astype(np.uint8)
        return np.repeat(grey[..., None], 3, axis=2)
    transparent = "transparency" in image.info or image.mode in ("RGBA", "LA", "PA", "La", "RGBa")
    return np.array(image.convert("RGBA" if transparent else "RGB"))


def _for_resizing(image: Image.Image) -> Image.Image:
    if image.mode.startswith("I"):
        return Image.fromarray(_as_rgb_or_rgba(image))
    transparent = "transparency" in image.info or image.mode in ("RGBA", "LA", "PA", "La", "RGBa")
    return image.convert("RGBA").convert("RGBa") if transparent else image.convert("RGB")


def downscaled(image_u8: np.ndarray, factor: float) -> np.ndarray:
    """A photo made smaller by `factor` (>= 1), each new pixel the mean over the area it covers.

    Sizes that the factor does not divide are rounded, at least 1 px; the new pixels then cover the photo exactly, and
    pixels on their edges count by their share. Factor 1 returns the photo itself.

    Args:
        image_u8: [height, width, 3 or 4] uint8, straight alpha.

    Raises:
        OptionInvalid: factor below 1.
    """
    if not (np.isfinite(factor) and factor >= 1):
        raise OptionInvalid("downscale", "must be at least 1", str(factor), "1 keeps the photos as they are.")
    return area_resized(image_u8, downscaled_size((image_u8.shape[1], image_u8.shape[0]), factor))


def downscaled_size(size_px: tuple[int, int], factor: float) -> tuple[int, int]:
    """(width, height) that `downscaled` gives."""
    return max(1, round(size_px[0] / factor)), max(1, round(size_px[1] / factor))


def area_resized(image_u8: np.ndarray, size_px: tuple[int, int]) -> np.ndarray:
    """A photo at a size (width, height) no larger than its own, by exact area averaging of premultiplied colour.

    Transparent pixels have no colour, so they lend none to their neighbours; where the result is fully transparent its
    colour is zero. Alpha and colour are rounded to the nearest byte once, at the end.
    """
    height, width = image_u8.shape[:2]
    if size_px == (width, height):
        return image_u8
    rows_per_strip = max(1, round(STRIP_PIXELS / width * size_px[1] / height))
    result = np.empty((size_px[1], size_px[0], image_u8.shape[2]), np.uint8)
    for first in range(0, size_px[1], rows_per_strip):
        last = min(first + rows_per_strip, size_px[1])
        top, bottom = first * height / size_px[1], last * height / size_px[1]
        start, stop = int(np.floor(top)), min(height, int(np.ceil(bottom)))
        sums = _premultiplied(image_u8[start:stop])
        sums = _interval_means(sums, np.linspace(top, bottom, last - first + 1) - start, axis=0)
        sums = _interval_means(sums, np.linspace(0, width, size_px[0] + 1), axis=1)
        result[first:last] = _straight_u8(sums)
    return result


def _premultiplied(image_u8: np.ndarray) -> np.ndarray:
    """[h, w, 3 or 4] float64: colour times alpha, then alpha, both in 0..255."""
    image = image_u8.astype(np.float64)
    if image.shape[2] == 4:
        image[..., :3] *= image[..., 3:] / 255.0
    return image


def _straight_u8(premultiplied: np.ndarray) -> np.ndarray:
    if premultiplied.shape[2] == 4:
        alpha = premultiplied[..., 3:]
        # Sums leave an alpha of about 1e-12 where there was none.
        colour = np.zeros_like(premultiplied[..., :3])
        np.divide(premultiplied[..., :3] * 255.0, alpha, where=alpha > 1e-6, out=colour)
        premultiplied = np.concatenate([colour, alpha], -1)
        premultiplied[np.rint(alpha[..., 0]) == 0] = 0.0
    return np.rint(np.clip(premultiplied, 0.0, 255.0)).astype(np.uint8)


def _interval_means(values: np.ndarray, edges: np.ndarray, axis: int) -> np.ndarray:
    """Means of piecewise constant `values` over [edges[i], edges[i + 1]] along an axis, by a running integral.

    Whole factors, the usual case, are summed directly (5 times faster).
    """
    values = np.moveaxis(values, axis, 0)
    step = len(values) // (len(edges) - 1)
    if (edges == np.arange(len(edges)) * step).all():
        total = values[::step].copy()
        for offset in range(1, step):
            total += values[offset::step]
        return np.moveaxis(total / step, 0, axis)
    integral = np.concatenate([np.zeros_like(values[:1]), np.cumsum(values, axis=0)])
    whole = np.clip(np.floor(edges).astype(int), 0, len(values) - 1)
    share = (edges - whole).reshape(-1, *[1] * (values.ndim - 1))
    at_edges = integral[whole] + share * values[whole]
    width = np.diff(edges).reshape(-1, *[1] * (values.ndim - 1))
    return np.moveaxis(np.diff(at_edges, axis=0) / width, 0, axis)
