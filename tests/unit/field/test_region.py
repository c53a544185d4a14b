"""Where the object is: the frame and the visual hull."""

from dataclasses import replace

import numpy as np
import pytest

from core.camera import Camera
from core.capture import Capture, View
from core.errors import CaptureEmpty
from core.field.frame import Frame
from core.field.region import REACH_WITHOUT_ALPHA, Region, find_region, visual_hull
from core.scene_kind import OBJECT, SceneKind
from tests.unit.training.captures import ball, capture_of, ring_cameras


def moved_camera(camera: Camera, scale: float, offset: np.ndarray) -> Camera:
    pose = camera.world_from_camera.copy()
    pose[:3, 3] = pose[:3, 3] * scale + offset
    return replace(camera, world_from_camera=pose)


def moved(capture: Capture, scale: float, offset: np.ndarray) -> Capture:
    """The same photos of a scene that is `scale` times as large and elsewhere."""
    views = (
        tuple(replace(v, camera=moved_camera(v.camera, scale, offset)) for v in part)
        for part in (capture.train, capture.test)
    )
    return Capture(*views)


def photos_of_points(points: np.ndarray, cameras: list[Camera]) -> list[View]:
    """Photos that are opaque exactly in the pixels that some point [n, 3] falls into."""
    views = []
    for camera in cameras:
        local = (points - camera.position) @ camera.world_from_camera[:3, :3]
        xy = local[:, :2] / -local[:, 2:] * camera.focal_px * np.array([1, -1]) + camera.centre_px
        width, height = camera.size_px
        image = np.zeros((height, width, 4), np.uint8)
        column, row = np.floor(xy[local[:, 2] < 0]).astype(int).T
        seen = (column >= 0) & (column < width) & (row >= 0) & (row < height)
        image[row[seen], column[seen]] = 255
        views.append(View(camera, image))
    return views


def cells_of(points: np.ndarray, frame: Frame, cells: int) -> np.ndarray:
    """[cells]^3 bool: cells that hold a point."""
    place = np.floor((frame.to_scene(points) + 1) * cells / 2).astype(int)
    held = np.zeros((cells,) * 3, bool)
    held[tuple(place.T)] = True
    return held


def assert_same_region(actual: Region, expected: Region, scale: float, offset: np.ndarray) -> None:
    # Positions in units of the scene; the search's cells are float32 numbers, a cell more or less is 1/96 of its box.
    np.testing.assert_allclose((actual.frame.centre - offset) / scale, expected.frame.centre, atol=0.05)
    assert actual.frame.half / scale == pytest.approx(expected.frame.half, rel=0.05)
    assert abs(actual.hull.mean() - expected.hull.mean()) < 0.05


@pytest.fixture(scope="module")
def photographed_ball() -> tuple[Capture, Region]:
    capture = capture_of(ball())
    return capture, find_region(capture)


@pytest.mark.parametrize(("scale", "offset"), [(1e-6, 0.0), (1e6, 0.0), (1.0, 1e3), (1e-6, 10.0), (1e6, 10.0)])
def test_a_scene_of_any_size_at_any_place_has_the_same_region(photographed_ball, scale, offset):
    capture, expected = photographed_ball
    away = offset * scale * np.array([1.0, -0.7, 0.4])
    assert_same_region(find_region(moved(capture, scale, away)), expected, scale, away)


def test_the_frame_encloses_the_object_tightly():
    region = find_region(capture_of(ball(radius=0.6, centre=(0.3, -0.2, 0.1)), size_px=64, views=16))
    assert np.abs(region.frame.centre - [0.3, -0.2, 0.1]).max() < 0.15
    assert 0.6 < region.frame.half < 0.9


def test_the_hull_holds_the_object_and_little_else(rng):
    region = find_region(capture_of(ball(radius=0.7), size_px=64, views=16))
    points = rng.normal(size=(5000, 3))
    points *= 0.69 / np.linalg.norm(points, axis=1, keepdims=True)
    assert region.hull[cells_of(points, region.frame, 64)].all()
    assert region.hull.mean() < 0.85


@pytest.mark.parametrize("focal_px", [150.0, 40.0])
def test_the_hull_keeps_a_rod_thinner_than_a_pixel(rng, focal_px):
    ends = np.array([[-0.8, -0.5, -0.7], [0.7, 0.8, 0.75]])
    rod = ends[0] + np.linspace(0, 1, 4000)[:, None] * (ends[1] - ends[0])
    cameras = [replace(c, focal_px=(focal_px, focal_px)) for c in ring_cameras(20, 100)]
    hull = visual_hull(photos_of_points(rod, cameras), Frame(np.zeros(3), 1.0))
    assert hull[cells_of(rod, Frame(np.zeros(3), 1.0), 64)].all()
    assert hull.mean() < 0.3


def test_the_hull_keeps_points_anywhere_for_cameras_with_wide_lenses(rng):
    points = rng.uniform(-0.95, 0.95, (40, 3))
    cameras = [replace(c, focal_px=(25.0, 25.0)) for c in ring_cameras(12, 64, radius=2.0)]
    for point in points:
        frame = Frame(np.zeros(3), 1.0)
        hull = visual_hull(photos_of_points(point[None], cameras), frame, 32)
        assert hull[cells_of(point[None], frame, 32)].all()


def test_an_object_without_an_alpha_channel_is_around_the_point_looked_at():
    capture = replace(capture_of(ball(), alpha=False), kind=SceneKind(OBJECT, "chosen", overridden=True))
    region = find_region(capture)
    np.testing.assert_allclose(region.frame.centre, 0.0, atol=1e-3)
    assert region.frame.half == pytest.approx(4.0 * REACH_WITHOUT_ALPHA, rel=1e-3)
    assert region.hull.all()


def test_masks_without_a_common_point_are_refused():
    capture = capture_of(ball(radius=0.1))
    away = [capture_of(ball(radius=0.1, centre=c)) for c in ((0.9, 0, 0), (-0.9, 0, 0.5), (0, 0.9, -0.9))]
    views = [part.train[i] for i, part in enumerate([capture, *away] * 2)]
    with pytest.raises(CaptureEmpty, match="common"):
        find_region(Capture(tuple(views), ()))


@pytest.mark.parametrize("count", [2, 5])
def test_photos_from_one_and_the_same_place_do_not_break_the_search(count):
    region = find_region(Capture(capture_of(ball()).train[:1] * count, ()))
    assert np.isfinite(region.frame.centre).all()
    assert region.frame.half > 0


def test_parallel_cameras_do_not_break_the_search():
    views = []
    for x in (-0.5, 0.0, 0.5):
        pose = np.eye(4)
        pose[:3, 3] = (x, 0.0, 4.0)
        camera = Camera(f"{x}", pose, (40.0, 40.0), (16.0, 16.0), (32, 32))
        views.append(View(camera, np.full((32, 32, 4), 255, np.uint8)))
    try:
        region = find_region(Capture(tuple(views), ()))
    except CaptureEmpty:
        return
    assert np.isfinite(region.frame.half)
    assert region.frame.half > 0


def test_frames_map_there_and_back(rng):
    frame = Frame(np.array([3.0, -2.0, 7.0]), 0.25)
    points = rng.normal(size=(20, 3))
    np.testing.assert_allclose(frame.to_object(frame.to_scene(points)), points, atol=1e-12)
    np.testing.assert_allclose(frame.to_object(np.array([1.0, -1.0, 0.0])), [3.25, -2.25, 7.0])
