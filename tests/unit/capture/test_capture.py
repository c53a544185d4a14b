from dataclasses import replace

import numpy as np
import pytest

from core.errors import CaptureEmpty, ImageSizeMismatch, PosesInvalid
from tests.unit.capture.captures import capture_of, ring, row, view_at


def masked(view, ignored):
    return replace(view, ignored=np.full((6, 8), ignored))


def test_mask_has_the_photos_size():
    with pytest.raises(ImageSizeMismatch, match="mask"):
        replace(view_at(row()[0]), ignored=np.zeros((8, 6), bool))


@pytest.mark.parametrize("bounds", [(0, 1), (2, 1), (-1, 1), (1, np.inf), (np.nan, 1)])
def test_depth_bounds_are_positive_and_in_order(bounds):
    with pytest.raises(PosesInvalid, match="depth bounds"):
        view_at(row()[0], depth_range=bounds)


def test_photos_that_are_masked_entirely_are_refused():
    capture = capture_of(row())
    with pytest.raises(CaptureEmpty, match="mask"):
        replace(capture, train=tuple(masked(view, True) for view in capture.train))
    assert replace(capture, train=(masked(capture.train[0], False), *capture.train[1:]))


def test_kind_stays_when_views_are_replaced():
    capture = capture_of(ring())
    assert replace(capture, train=capture.train[:2]).kind is capture.kind
