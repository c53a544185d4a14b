"""What stands behind a scene."""

from dataclasses import replace

import numpy as np
import pytest

from core.baking.background import background_of
from core.capture import WHITE
from core.scene_kind import FORWARD, OBJECT, SceneKind
from tests.unit.capture.captures import capture_of, ring

GREY = 128 / 255


def test_an_object_keeps_the_captures_background():
    capture = capture_of(ring(), kind=SceneKind(OBJECT, "for the test"))
    assert background_of(capture) == WHITE


def test_an_open_scene_has_its_photos_mean_colour_behind_it():
    capture = capture_of(ring(), kind=SceneKind(FORWARD, "for the test"))
    assert background_of(capture) == pytest.approx((GREY, GREY, GREY))
    np.testing.assert_array_less(background_of(capture), 1.0)


def test_a_background_that_was_chosen_stays():
    capture = replace(capture_of(ring(), kind=SceneKind(FORWARD, "for the test")), background=(0.0, 0.5, 1.0))
    assert background_of(capture) == (0.0, 0.5, 1.0)
