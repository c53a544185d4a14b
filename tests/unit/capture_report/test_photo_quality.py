"""Blur and exposure, on photos that we spoil."""

import numpy as np
import pytest
from PIL import Image, ImageFilter

from core.capture_report.photo_quality import BLURRED_BELOW, Look, compared, look_of


def textured(seed: int, size: tuple[int, int] = (240, 180), brightness: float = 0.4) -> np.ndarray:
    """[h, w, 3] uint8 of fine and coarse blots."""
    rng = np.random.default_rng(seed)
    total = np.zeros((size[1], size[0], 3))
    for cells in (10, 40, 120):
        blots = rng.integers(0, 256, (cells, cells, 3), np.uint8)
        total += np.asarray(Image.fromarray(blots).resize(size, Image.Resampling.BICUBIC), np.float64) / 3
    return np.clip(total * brightness / 0.5, 0, 255).astype(np.uint8)


def quality(images: list[np.ndarray]) -> list:
    return list(compared([str(i) for i in range(len(images))], [False] * len(images), [look_of(i) for i in images]))


def test_photos_alike_have_no_flags() -> None:
    photos = quality([textured(seed) for seed in range(8)])
    assert not any(photo.blurred or photo.jumps for photo in photos)
    assert all(photo.sharpness == pytest.approx(1.0, abs=0.3) for photo in photos)


def test_blurred_photo_is_flagged_alone() -> None:
    images = [textured(seed) for seed in range(8)]
    images[3] = np.asarray(Image.fromarray(images[3]).filter(ImageFilter.GaussianBlur(1.5)))
    photos = quality(images)
    assert [photo.name for photo in photos if photo.blurred] == ["3"]
    assert photos[3].sharpness < BLURRED_BELOW


@pytest.mark.parametrize(("factor", "stops"), [(2.0, 1.0), (0.5, -1.0)])
def test_exposure_jump_is_flagged_with_its_stops(factor: float, stops: float) -> None:
    images = [textured(seed) for seed in range(8)]
    linear = (images[5] / 255.0) ** 2.2 * factor
    images[5] = np.rint(255 * np.clip(linear, 0, 1) ** (1 / 2.2)).astype(np.uint8)
    photos = quality(images)
    assert [photo.name for photo in photos if photo.jumps] == ["5"]
    assert photos[5].exposure_stops == pytest.approx(stops, abs=0.2)  # 2.2 is not quite sRGB's curve


def test_photos_that_differ_anyway_hide_no_jump_but_are_not_flagged() -> None:
    """A set whose photos differ by a stop in content: half a stop more is nothing."""
    looks = [Look(100.0, value) for value in (-3.0, -2.5, -2.0, -1.5, -1.0, -0.5)]
    assert not any(photo.jumps for photo in compared(list("abcdef"), [False] * 6, looks))


def test_transparent_and_masked_pixels_do_not_count() -> None:
    image = textured(0)
    half = np.zeros(image.shape[:2], bool)
    half[:, :120] = True
    spoilt = np.where(half[..., None], np.uint8(255), image)
    alpha = np.dstack([spoilt, np.where(half, np.uint8(0), np.uint8(255))])
    assert look_of(alpha) == look_of(spoilt, half)
    assert look_of(alpha).sharpness == pytest.approx(look_of(image).sharpness, rel=0.2)


def test_photo_without_enough_pixels_is_not_judged() -> None:
    looks = [look_of(np.zeros((20, 20, 4), np.uint8)), look_of(textured(0)), look_of(textured(1))]
    assert looks[0] == Look(None, None)
    first = compared(["a", "b", "c"], [False] * 3, looks)[0]
    assert (first.sharpness, first.exposure_stops, first.blurred, first.jumps) == (None, None, False, False)
