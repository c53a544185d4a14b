"""The object frame does not depend on where and how large the user's scene is, and leads back to it exactly."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from core.conventions import ASSET_FROM_Z_UP
from core.normalisation import normalised, pose_in_user_frame
from core.scene_kind import FORWARD, OBJECT, UNBOUNDED
from tests.unit.capture.captures import capture_of, facing, moved, random_rotation, ring, row

POINTS = np.random.default_rng(1).uniform(-1, 1, (50, 3))
EXTREMES = [
    {"scale": 1e-6},
    {"scale": 1e6},
    {"shift": (3e6, -2e6, 1e6)},
    {"scale": 1e-6, "shift": (3.0, -2.0, 1.0)},
    {"scale": 1e6, "shift": (3e12, -2e12, 1e12)},
]


def poses_of(capture):
    return np.array([view.camera.world_from_camera for view in (*capture.train, *capture.test)])


@pytest.mark.parametrize("change", EXTREMES)
@pytest.mark.parametrize("poses", [ring(), ring(arc=1.0), row()], ids=["ring", "arc", "row"])
@pytest.mark.parametrize("up_known", [True, False])
def test_size_and_place_do_not_matter(poses, change, up_known):
    plain = normalised(capture_of(poses), up_known=up_known)
    extreme = normalised(capture_of(moved(poses, **change)), up_known=up_known)
    assert extreme.kind == plain.kind
    # Positions a million sizes away are stated to 1e-10 of a size; where axes are nearly parallel, less.
    np.testing.assert_allclose(poses_of(extreme), poses_of(plain), atol=1e-8)


@pytest.mark.parametrize("poses", [ring(), ring(arc=1.0), row()], ids=["ring", "arc", "row"])
def test_orientation_does_not_matter_where_up_is_not_known(poses):
    plain = normalised(capture_of(poses), up_known=False)
    for seed in range(5):
        turned = capture_of(moved(poses, rotation=random_rotation(seed), shift=(1, 2, 3)))
        np.testing.assert_allclose(poses_of(normalised(turned, up_known=False)), poses_of(plain), atol=1e-9)


@pytest.mark.parametrize("change", [{}, *EXTREMES])
@pytest.mark.parametrize("up_known", [True, False])
def test_user_from_object_leads_back(change, up_known):
    poses = moved(ring(), **change)
    scale = change.get("scale", 1.0)
    points = POINTS * scale + change.get("shift", 0)
    capture = capture_of(poses, points=points, depth_range=(2.0 * scale, 5.0 * scale))
    result = normalised(capture, up_known=up_known)
    to_user = result.user_from_object
    far = np.abs(np.array(poses)[:, :3, 3]).max()
    for view, pose in zip((*result.train, *result.test), poses, strict=True):
        np.testing.assert_allclose(pose_in_user_frame(to_user, view.camera)[:3, 3], pose[:3, 3], atol=1e-14 * far)
        np.testing.assert_allclose(pose_in_user_frame(to_user, view.camera)[:3, :3], pose[:3, :3], atol=1e-12)
    np.testing.assert_allclose(result.points @ to_user[:3, :3].T + to_user[:3, 3], points, atol=1e-14 * far)
    near, far = result.train[0].depth_range
    unit = np.cbrt(np.linalg.det(to_user[:3, :3]))
    assert (near * unit, far * unit) == pytest.approx((2 * scale, 5 * scale))


def test_known_up_keeps_the_axes_and_the_assets_place():
    result = normalised(capture_of(moved(ring(), scale=2, shift=(1, 2, 3))))
    scale = result.user_from_object[0, 0]
    np.testing.assert_array_equal(result.user_from_object[:3, :3], scale * np.eye(3))
    np.testing.assert_allclose(result.user_from_object[:3, 3], (1, 2, 3), atol=1e-3)
    np.testing.assert_array_equal(result.asset_from_object, ASSET_FROM_Z_UP @ result.user_from_object)


def test_unknown_up_makes_the_asset_upright_and_centred():
    result = normalised(capture_of(moved(ring(), rotation=random_rotation(3), shift=(1, 2, 3))), up_known=False)
    np.testing.assert_array_equal(result.asset_from_object, ASSET_FROM_Z_UP)


@pytest.mark.parametrize("kind", [OBJECT, UNBOUNDED])
def test_ring_is_centred_at_what_it_looks_at_with_median_distance_one(kind):
    channels = 4 if kind == OBJECT else 3
    result = normalised(capture_of(moved(ring(), scale=7, shift=(1, 2, 3)), channels=channels))
    assert result.kind.name == kind
    distances = [np.linalg.norm(view.camera.position) for view in result.train]
    assert np.median(distances) == pytest.approx(1, abs=1e-6)
    assert max(distances) == pytest.approx(1, abs=1e-3)


def test_forward_scene_is_centred_in_the_middle_of_its_bounds_in_disparity():
    result = normalised(capture_of(row(), depth_range=(2.0, 6.0)))
    assert result.kind.name == FORWARD
    middle = np.mean([view.camera.position for view in result.train], 0)
    np.testing.assert_allclose(middle, (0, -1, 0), atol=0.02)
    assert result.user_from_object[0, 0] == pytest.approx(3.0, rel=0.02)  # 1 / 3 lies between 1 / 2 and 1 / 6


def test_forward_scene_without_bounds_is_as_deep_as_its_points():
    points = POINTS + np.array([0, 5, 0])
    result = normalised(capture_of(row(), points=points))
    assert result.user_from_object[0, 0] == pytest.approx(np.median(points[:, 1]), rel=0.02)


@pytest.mark.parametrize("tilt", [0.0, 0.5, -0.5])
def test_up_is_found_for_tilted_cameras(tilt):
    # Cameras that look up or down keep their right axes level.
    positions = [(3 * np.cos(a), 3 * np.sin(a), 0.0) for a in np.arange(8)]
    poses = [facing(p, -np.array(p) + (0, 0, 3 * tilt)) for p in positions]
    rotation = random_rotation(7)
    result = normalised(capture_of(moved(poses, rotation=rotation)), up_known=False)
    np.testing.assert_allclose(result.user_from_object[:3, 2] / np.cbrt(np.linalg.det(result.user_from_object[:3, :3])),
                               rotation[:, 2], atol=1e-9)  # fmt: skip


def test_forward_cameras_look_along_y():
    result = normalised(capture_of(moved(row(), rotation=random_rotation(2))), up_known=False)
    for view in result.train:
        np.testing.assert_allclose(view.camera.world_from_camera[:3, 2], (0, -1, 0), atol=1e-9)


ONE_PLACE = [facing((1, 2, 3), (np.sin(a), np.cos(a), 0)) for a in (-0.2, 0.0, 0.3)]


@pytest.mark.parametrize(
    "poses",
    [
        ONE_PLACE,
        [ONE_PLACE[0]] * 3,
        [facing((1, 2, 3), (np.cos(a), np.sin(a), 0.1)) for a in range(7)],
        moved(ONE_PLACE, shift=(1e6, 1e6, 1e6)),
        row(3),
        row(3, step=1e-9),
        [facing((0, i, 0), (0, 1, 0)) for i in range(4)],
        [facing((0, 0, 3), (0, 0, -1), up=(0, 1, 0)), facing((0, 0, 2), (0, 0, -1), up=(0, 1, 0))] * 2,
        [facing((0, 0, 3), (0, 0.1, -1)), facing((0, 0, -3), (0, 0.1, 1)), facing((3, 0, 0), (-1, 0, 0))],
        ring(3),
        ring(3, radius=1e-3),
    ],
    ids=["one place", "one pose", "panorama", "far place", "parallel", "close", "one behind another", "downwards",
         "up and down", "two photos", "from above"],
)  # fmt: skip
@pytest.mark.parametrize("channels", [3, 4])
@pytest.mark.parametrize("up_known", [True, False])
@pytest.mark.parametrize("points", [None, POINTS + np.array([0, 4, 0])])
def test_degenerate_cameras_have_a_frame(poses, channels, up_known, points):
    result = normalised(capture_of(poses, channels=channels, points=points), up_known=up_known)
    matrix = result.user_from_object
    assert np.isfinite(matrix).all()
    scale = np.cbrt(np.linalg.det(matrix[:3, :3]))
    assert scale > 0
    np.testing.assert_allclose(matrix[:3, :3] @ matrix[:3, :3].T / scale**2, np.eye(3), atol=1e-12)
    assert np.isfinite(poses_of(result)).all()


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 10_000), st.integers(3, 12), st.booleans())
def test_any_cameras_lead_back(seed, count, up_known):
    rng = np.random.default_rng(seed)
    poses = [facing(rng.normal(size=3) * 10.0 ** rng.integers(-3, 4), rng.normal(size=3)) for _ in range(count)]
    result = normalised(capture_of(poses), up_known=up_known)
    size = np.abs(np.array(poses)[:, :3, 3]).max()
    for view, pose in zip((*result.train, *result.test), poses, strict=True):
        np.testing.assert_allclose(pose_in_user_frame(result.user_from_object, view.camera)[:3, 3], pose[:3, 3],
                                   atol=1e-12 * size)  # fmt: skip


def test_normalising_twice_changes_little_and_still_leads_back():
    poses = moved(ring(), scale=5, shift=(1, 2, 3))
    twice = normalised(normalised(capture_of(poses)))
    for view, pose in zip((*twice.train, *twice.test), poses, strict=True):
        np.testing.assert_allclose(pose_in_user_frame(twice.user_from_object, view.camera), pose, atol=1e-12)
