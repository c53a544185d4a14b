"""How alike two images are. float64, data range 1."""

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from core.errors import ImageSizeMismatch

SSIM_WINDOW_PX = 11
SSIM_SIGMA_PX = 1.5
SSIM_C1, SSIM_C2 = 0.01**2, 0.03**2


def psnr(a: np.ndarray, b: np.ndarray, ignored: np.ndarray | None = None) -> float:
    """Peak signal-to-noise ratio of two images in [0, 1], dB: -10 log10 of the mean squared error of all values.

    Infinite for equal images.

    Args:
        ignored: [h, w] bool, pixels that do not count; not all of them.

    Raises:
        ImageSizeMismatch: the shapes differ.
    """
    a, b = _pair(a, b)
    squares = (a - b) ** 2 if ignored is None else ((a - b) ** 2)[~ignored]
    error = float(np.mean(squares))
    return float("inf") if error == 0 else -10.0 * float(np.log10(error))


def ssim(a: np.ndarray, b: np.ndarray, ignored: np.ndarray | None = None) -> float:
    """Structural similarity (Wang et al. 2004) of two images [h, w] or [h, w, channels] in [0, 1]: at most 1.

    Gaussian window of 11 x 11 px, sigma 1.5 px, population covariance, K1 0.01, K2 0.03; the mean over the channels and
    over the positions where the window lies wholly inside the image ("valid"). NeRF papers report this; it equals
    scikit-image's structural_similarity(gaussian_weights=True, sigma=1.5, use_sample_covariance=False, data_range=1).
    Along a side shorter than 11 px the window is cut to the side's length.

    Args:
        ignored: [h, w] bool, pixels that count as equal; windows around them are not in the mean, if others are.

    Raises:
        ImageSizeMismatch: the shapes differ.
    """
    a, b = _pair(a, b)
    if ignored is not None:
        b = np.where(ignored if a.ndim == 2 else ignored[..., None], a, b)
    mean_a, mean_b = _blurred(a), _blurred(b)
    variance_a = _blurred(a * a) - mean_a**2
    variance_b = _blurred(b * b) - mean_b**2
    covariance = _blurred(a * b) - mean_a * mean_b
    luminance = (2 * mean_a * mean_b + SSIM_C1) / (mean_a**2 + mean_b**2 + SSIM_C1)
    structure = (2 * covariance + SSIM_C2) / (variance_a + variance_b + SSIM_C2)
    likeness = luminance * structure
    counts = None if ignored is None else ~_window_centres(ignored)
    return float(np.mean(likeness if counts is None or not counts.any() else likeness[counts]))


def _window_centres(image: np.ndarray) -> np.ndarray:
    """The values [h, w] at the positions of `_blurred`."""
    margins = [(min(SSIM_WINDOW_PX, side) - 1) for side in image.shape]
    rows, columns = (slice(m // 2, side - (m - m // 2)) for m, side in zip(margins, image.shape, strict=True))
    return image[rows, columns]


def _pair(a: np.ndarray, b: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    a, b = np.asarray(a, np.float64), np.asarray(b, np.float64)
    if a.shape != b.shape or a.size == 0:
        raise ImageSizeMismatch(
            "image comparison", "both images must have the same size and channels", f"{a.shape} and {b.shape}"
        )
    return a, b


def _blurred(image: np.ndarray) -> np.ndarray:
    """The Gaussian mean at every position where the window fits."""
    for axis in (0, 1):
        weights = _window(min(SSIM_WINDOW_PX, image.shape[axis]))
        image = sliding_window_view(image, len(weights), axis) @ weights
    return image


def _window(length: int) -> np.ndarray:
    """[length] Gaussian weights about the middle, summing to 1."""
    offset = np.arange(length) - (length - 1) / 2
    weights = np.exp(-0.5 * (offset / SSIM_SIGMA_PX) ** 2)
    return weights / weights.sum()
