"""Blur and exposure of photos, each against the others of its set."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from core.images import area_resized

# Both are measured at this longest side, so that photos of different sizes compare. Published captures (fern, fox,
# lego, sceaux) have no photo below 0.5 of their set's median; a blur of one pixel leaves 0.1, of 0.7 pixels 0.2.
SIDE_PX = 640
BLURRED_BELOW = 0.3
# A jump is far from what the set's photos differ by anyway: a dark table from above is no fault of the exposure.
JUMP_DEVIATIONS = 3.5
LEAST_JUMP_STOPS = 0.5
LEAST_PIXELS = 64
DARKEST = 1e-4  # of linear luminance; black has no logarithm
LUMA = (0.299, 0.587, 0.114)
LUMINANCE = (0.2126, 0.7152, 0.0722)
_ENCODED = np.arange(256) / 255.0
LINEAR_OF_BYTE = np.where(_ENCODED <= 0.04045, _ENCODED / 12.92, ((_ENCODED + 0.055) / 1.055) ** 2.4)


@dataclass(frozen=True)
class Look:
    """What is measured of a photo alone. Either is None where it has too few pixels to tell.

    Attributes:
        sharpness: variance of the Laplacian of its grey values in [0, 255].
        log2_luminance: of its median pixel, linear.
    """

    sharpness: float | None
    log2_luminance: float | None


@dataclass(frozen=True)
class PhotoQuality:
    """A photo against the median of its set.

    Attributes:
        name: of the photo.
        held_out: whether it is kept for measuring.
        sharpness: ratio to the median; None if not known.
        exposure_stops: difference from the median, in stops; None if not known.
        blurred, jumps: whether it stands out.
    """

    name: str
    held_out: bool
    sharpness: float | None
    exposure_stops: float | None
    blurred: bool
    jumps: bool


def look_of(image_u8: np.ndarray, ignored: np.ndarray | None = None) -> Look:
    """Measures a photo [h, w, 3 or 4] uint8; transparent and ignored ([h, w] bool) pixels do not count."""
    small, used = _reduced(image_u8, ignored)
    return Look(_sharpness((small @ np.array(LUMA, np.float32)), used), _log2_luminance(small, used))


def compared(names: Sequence[str], held_out: Sequence[bool], looks: Sequence[Look]) -> tuple[PhotoQuality, ...]:
    """Each photo against its set."""
    sharpness = _array(look.sharpness for look in looks)
    sharpness = sharpness / (_median(sharpness) or 1.0)
    stops = _array(look.log2_luminance for look in looks)
    stops = stops - (_median(stops) or 0.0)
    limit = max(LEAST_JUMP_STOPS, JUMP_DEVIATIONS * 1.4826 * (_median(np.abs(stops)) or 0.0))
    return tuple(
        PhotoQuality(name, held, _or_none(sharp), _or_none(stop), bool(sharp < BLURRED_BELOW), bool(abs(stop) > limit))
        for name, held, sharp, stop in zip(names, held_out, sharpness, stops, strict=True)
    )


def _reduced(image_u8: np.ndarray, ignored: np.ndarray | None) -> tuple[np.ndarray, np.ndarray]:
    """([h, w, 3] uint8, [h, w] bool: wholly there)."""
    height, width = image_u8.shape[:2]
    scale = min(1.0, SIDE_PX / max(width, height))
    size = max(1, round(width * scale)), max(1, round(height * scale))
    there = np.full((height, width), 255, np.uint8) if image_u8.shape[2] == 3 else image_u8[..., 3]
    if ignored is not None:
        there = np.where(ignored, np.uint8(0), there)
    image = area_resized(np.dstack([image_u8[..., :3], there]), size)
    return image[..., :3], image[..., 3] == 255


def _sharpness(grey: np.ndarray, used: np.ndarray) -> float | None:
    inner = grey[1:-1, 1:-1]
    laplacian = grey[1:-1, 2:] + grey[1:-1, :-2] + grey[2:, 1:-1] + grey[:-2, 1:-1] - 4.0 * inner
    whole = used[1:-1, 1:-1] & used[1:-1, 2:] & used[1:-1, :-2] & used[2:, 1:-1] & used[:-2, 1:-1]
    return float(laplacian[whole].var()) if np.count_nonzero(whole) >= LEAST_PIXELS else None


def _log2_luminance(image: np.ndarray, used: np.ndarray) -> float | None:
    if np.count_nonzero(used) < LEAST_PIXELS:
        return None
    luminance = LINEAR_OF_BYTE[image[used]] @ np.array(LUMINANCE)
    return float(np.log2(max(DARKEST, np.median(luminance))))


def _array(values: object) -> np.ndarray:
    return np.array([np.nan if value is None else value for value in values], np.float64)  # type: ignore[attr-defined]


def _median(values: np.ndarray) -> float | None:
    known = values[np.isfinite(values)]
    return float(np.median(known)) if len(known) else None


def _or_none(value: float) -> float | None:
    return round(float(value), 3) if np.isfinite(value) else None
