"""Regions of scenes without a cut-out object: forward-facing and unbounded."""

import numpy as np
import pytest

from core.capture import Capture
from core.field.region import HULL_CELLS, Region, find_region
from core.kernels.space import SHELLS, TAPER
from core.scene_kind import FORWARD, UNBOUNDED, SceneKind
from tests.unit.capture.captures import capture_of, facing, ring

NEAR, FAR = 2.0, 40.0


def row() -> Capture:
    """Eight cameras side by side that look along +y, slightly turned."""
    poses = [facing((0.1 * i, 0.02 * (i % 3), 0.05 * (i % 2)), (0.03 * (4 - i), 1, 0.02)) for i in range(8)]
    return capture_of(poses, depth_range=(NEAR, FAR), kind=SceneKind(FORWARD, "for the test"))


def around() -> Capture:
    return capture_of(ring(12), kind=SceneKind(UNBOUNDED, "for the test"))


def seen_points(capture: Capture, depths: np.ndarray) -> np.ndarray:
    """[n, 3], object frame: what the corners of all training photos see at depths along the optical axes."""
    points = []
    for view in capture.train:
        width, height = view.camera.size_px
        corners = np.array([[0, 0], [width, 0], [0, height], [width, height]], float)
        directions = view.camera.directions(corners)
        ahead = directions @ -view.camera.world_from_camera[:3, 2]
        points += [view.camera.position + directions * (depth / ahead)[:, None] for depth in depths]
    return np.concatenate(points)


def grid_points(region: Region, points: np.ndarray) -> np.ndarray:
    return region.space.to_grid(region.frame.to_scene(points))


def test_a_forward_facing_grid_holds_all_that_photos_show_between_near_and_far():
    region = find_region(row())
    assert region.space.kind == TAPER
    inside = np.abs(grid_points(region, seen_points(row(), np.linspace(NEAR, FAR, 20)))) <= 1 + 1e-9
    assert inside.all()


def test_a_forward_facing_grid_is_no_larger_than_that():
    region = find_region(row())
    reached = np.abs(grid_points(region, seen_points(row(), np.linspace(NEAR, FAR, 20)))).max(0)
    assert (reached > 0.9).all()


def test_forward_facing_scenes_lie_ahead_along_z():
    region = find_region(row())
    np.testing.assert_allclose(region.frame.rotation.T @ region.frame.rotation, np.eye(3), atol=1e-12)
    assert np.linalg.det(region.frame.rotation) == pytest.approx(1.0)
    assert region.frame.rotation[:, 2] @ [0, 1, 0] > 0.99
    points = np.random.default_rng(0).normal(size=(20, 3))
    np.testing.assert_allclose(region.frame.to_object(region.frame.to_scene(points)), points, atol=1e-12)


def test_an_unbounded_scenes_cube_holds_all_cameras():
    region = find_region(around())
    assert region.space.kind == SHELLS
    positions = np.array([view.camera.position for view in around().train])
    assert np.abs(region.frame.to_scene(positions)).max() < 1


@pytest.mark.parametrize("capture", [row(), around()], ids=["forward", "unbounded"])
def test_the_backdrop_is_always_there_and_lenses_are_clear(capture):
    region = find_region(capture)
    assert region.hull[region.space.backdrop(HULL_CELLS)].all()
    if region.space.kind == SHELLS:
        cells = (
            (grid_points(region, np.array([v.camera.position for v in capture.train])) + 1) * HULL_CELLS / 2
        ).astype(int)
        assert not region.hull[tuple(cells.T)].any()


def test_cameras_without_any_spread_have_a_region():
    turn = [facing((0, 0, 0), (np.cos(a), np.sin(a), 0)) for a in np.arange(9) * 0.7]
    region = find_region(capture_of(turn))
    assert np.isfinite(region.frame.centre).all()
    assert region.frame.half > 0
