import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import array_shapes, arrays

from core.metrics import psnr, ssim

FEW = settings(max_examples=50, deadline=None, derandomize=True)


@st.composite
def image_pairs(draw):
    sides, channels = draw(array_shapes(min_dims=2, max_dims=2, max_side=16)), draw(st.sampled_from([1, 3]))
    images = arrays(np.float64, (*sides, channels), elements=st.floats(0, 1, width=32))
    return draw(images), draw(images)


@FEW
@given(image_pairs())
def test_metrics_are_symmetric_and_bounded(pair):
    a, b = pair
    assert psnr(a, b) == psnr(b, a)
    assert ssim(a, b) == ssim(b, a)
    assert psnr(a, b) >= 0
    assert -1 - 1e-9 <= ssim(a, b) <= 1 + 1e-9  # the bounds are exact, the sums round


@FEW
@given(image_pairs())
def test_flipping_both_images_changes_nothing(pair):
    a, b = pair
    for flip in (np.flipud, np.fliplr, lambda image: image.swapaxes(0, 1)):
        assert psnr(flip(a), flip(b)) == pytest.approx(psnr(a, b), rel=1e-9)
        assert ssim(flip(a), flip(b)) == pytest.approx(ssim(a, b), abs=1e-9)


@FEW
@given(image_pairs())
def test_an_image_is_most_like_itself(pair):
    a, _ = pair
    assert ssim(a, a) == 1.0
    assert psnr(a, a) == float("inf")
