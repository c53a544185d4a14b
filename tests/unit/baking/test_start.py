"""Where a viewer starts."""

import numpy as np
import pytest

from core.baking.start import start_camera
from core.camera import Camera
from core.scene_kind import FORWARD, OBJECT, UNBOUNDED
from tests.scenes import look_at_camera


def row_of_cameras() -> list[Camera]:
    return [look_at_camera(f"{x}", (x, -3.0, 0.5), size_px=(8, 8)) for x in (-2.0, -1.0, 0.1, 1.0, 2.0)]


def test_object_starts_wherever_the_viewer_likes() -> None:
    assert start_camera(row_of_cameras(), OBJECT) is None


def test_forward_facing_scene_starts_in_the_middle_of_its_cameras() -> None:
    assert start_camera(row_of_cameras(), FORWARD) == 2


def test_unbounded_scene_starts_at_a_photo() -> None:
    angles = np.linspace(0, 2 * np.pi, 6, endpoint=False)
    ring = [look_at_camera("ring", (np.cos(a), np.sin(a), 0.3), size_px=(8, 8)) for a in angles]
    assert start_camera(ring, UNBOUNDED) == 0


@pytest.mark.parametrize("kind", [OBJECT, FORWARD, UNBOUNDED])
def test_scene_without_cameras_has_none_to_start_from(kind: str) -> None:
    assert start_camera([], kind) is None
