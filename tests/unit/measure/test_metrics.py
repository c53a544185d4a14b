import numpy as np
import pytest

from core.errors import ImageSizeMismatch
from core.metrics import SSIM_C1, psnr, ssim

EXACT = 1e-12  # float64 on both sides


def test_psnr_of_a_constant_error_is_its_size_in_db(rng):
    image = rng.uniform(0, 0.9, (7, 5, 3))
    assert psnr(image, image + 0.1) == pytest.approx(20.0, abs=1e-9)


def test_psnr_of_black_and_white_is_zero():
    assert psnr(np.zeros((4, 4, 3)), np.ones((4, 4, 3))) == 0.0


def test_psnr_of_equal_images_is_infinite(rng):
    image = rng.random((4, 4, 3))
    assert psnr(image, image) == float("inf")


def test_psnr_takes_the_mean_over_pixels_and_channels():
    error = np.zeros((2, 2, 3))
    error[0, 0, 0] = 1.0
    assert psnr(error, np.zeros((2, 2, 3))) == pytest.approx(10 * np.log10(12), abs=EXACT)


def test_psnr_is_over_the_pixels_that_count(rng):
    image, ignored = rng.uniform(0, 0.9, (6, 5, 3)), rng.random((6, 5)) < 0.5
    other = np.where(ignored[..., None], 0, image + 0.1)
    assert psnr(image, other, ignored) == pytest.approx(20.0, abs=1e-9)
    nothing = np.zeros((6, 5), bool)
    assert psnr(image, other, nothing) == psnr(image, other)


@pytest.mark.parametrize("shape", [(20, 30, 3), (20, 30), (8, 30, 3), (12, 15)])
def test_ssim_is_over_the_windows_whose_centres_count(rng, shape):
    image, other = rng.random(shape), rng.random(shape)
    half = np.zeros(shape[:2], bool)
    half[:, shape[1] // 2 :] = True
    assert ssim(image, other, half) < ssim(image, np.where(half if image.ndim == 2 else half[..., None], image, other))
    assert ssim(image, other, np.zeros(shape[:2], bool)) == pytest.approx(ssim(image, other), abs=EXACT)
    assert ssim(image, other, np.ones(shape[:2], bool)) == 1.0


def test_ssim_of_equal_images_is_one(rng):
    image = rng.random((20, 30, 3))
    assert ssim(image, image) == 1.0


@pytest.mark.parametrize(("a", "b"), [(0.0, 1.0), (0.2, 0.7), (0.5, 0.5)])
def test_ssim_of_constant_images_is_the_luminance_term(a, b):
    expected = (2 * a * b + SSIM_C1) / (a * a + b * b + SSIM_C1)
    # The variances cancel to 1e-16, beside a C2 of 9e-4.
    assert ssim(np.full((16, 16), a), np.full((16, 16), b)) == pytest.approx(expected, abs=1e-11)


def test_ssim_of_a_negative_is_negative(rng):
    image = rng.random((32, 32))
    assert ssim(image, 1 - image) < -0.8


@pytest.mark.parametrize("shape", [(11, 11), (12, 19, 3), (25, 11, 1)])
def test_ssim_agrees_with_the_sum_over_windows(rng, shape):
    a = rng.random(shape)
    b = np.clip(a + rng.normal(0, 0.1, shape), 0, 1)
    assert ssim(a, b) == pytest.approx(ssim_by_windows(a, b), abs=EXACT)


@pytest.mark.parametrize("shape", [(1, 1, 3), (2, 3), (5, 40), (10, 10, 3)])
def test_ssim_of_images_smaller_than_the_window_uses_what_fits(rng, shape):
    a, b = rng.random(shape), rng.random(shape)
    assert ssim(a, b) == pytest.approx(ssim_by_windows(a, b), abs=EXACT)
    assert ssim(a, a) == 1.0


@pytest.mark.parametrize("metric", [psnr, ssim])
@pytest.mark.parametrize(("a", "b"), [((4, 4, 3), (4, 4, 4)), ((4, 5), (5, 4)), ((0, 4, 3), (0, 4, 3))])
def test_unlike_or_empty_images_are_refused(metric, a, b):
    with pytest.raises(ImageSizeMismatch, match="same size"):
        metric(np.zeros(a), np.zeros(b))


def ssim_by_windows(a, b):
    """Wang et al. 2004, eq. 13-16, one window after the other."""
    a, b = a.reshape(*a.shape[:2], -1), b.reshape(*b.shape[:2], -1)
    rows, columns = min(11, a.shape[0]), min(11, a.shape[1])
    y = np.exp(-((np.arange(rows) - (rows - 1) / 2) ** 2) / (2 * 1.5**2))
    x = np.exp(-((np.arange(columns) - (columns - 1) / 2) ** 2) / (2 * 1.5**2))
    w = np.outer(y, x)[..., None] / (y.sum() * x.sum())
    scores = []
    for i in range(a.shape[0] - rows + 1):
        for j in range(a.shape[1] - columns + 1):
            p, q = a[i : i + rows, j : j + columns], b[i : i + rows, j : j + columns]
            mp, mq = (w * p).sum((0, 1)), (w * q).sum((0, 1))
            vp, vq = (w * (p - mp) ** 2).sum((0, 1)), (w * (q - mq) ** 2).sum((0, 1))
            vpq = (w * (p - mp) * (q - mq)).sum((0, 1))
            c1, c2 = 0.01**2, 0.03**2
            scores.append((2 * mp * mq + c1) * (2 * vpq + c2) / ((mp**2 + mq**2 + c1) * (vp + vq + c2)))
    return np.mean(scores)
