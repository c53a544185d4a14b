import numpy as np
import pytest

from core.errors import OptionInvalid
from core.scene_kind import AUTO, FORWARD, OBJECT, UNBOUNDED, SceneKind, chosen_kind
from tests.unit.capture.captures import capture_of, facing, moved, ring, row


def test_alpha_in_every_photo_makes_an_object():
    kind = capture_of(ring(), channels=4).kind
    assert (kind.name, kind.overridden) == (OBJECT, False)
    assert "alpha" in kind.reason


def test_cameras_side_by_side_are_forward_facing():
    assert capture_of(row()).kind.name == FORWARD


@pytest.mark.parametrize(("degrees", "name"), [(80, FORWARD), (100, UNBOUNDED), (360, UNBOUNDED)])
def test_arc_is_forward_facing_up_to_45_degrees_to_either_side(degrees, name):
    # The held-out camera, the arc's last, is not looked at.
    assert capture_of(ring(41, height=0, arc=np.radians(degrees))).kind.name == name


def test_reason_says_how_far_apart_the_cameras_look():
    assert "within 0 degrees" in capture_of(row()).kind.reason
    assert "all directions" in capture_of([*ring(40, height=0), *row(1)]).kind.reason


def test_cameras_one_behind_the_other_are_not_forward_facing():
    poses = [facing((0.1 * i, 1.0 * i, 0), (0, 1, 0)) for i in range(8)]
    assert capture_of(poses).kind.name == UNBOUNDED


@pytest.mark.parametrize(("near", "name"), [(3.0, FORWARD), (0.5, UNBOUNDED)])
def test_no_camera_may_stand_in_what_another_sees(near, name):
    poses = [facing((i, 0.4 * i, 0), (0, 1, 0)) for i in range(6)]
    kind = capture_of(poses, depth_range=(near, 20.0)).kind
    assert kind.name == name


@pytest.mark.parametrize(("distance", "name"), [(6.0, FORWARD), (0.5, UNBOUNDED)])
def test_points_tell_where_content_begins(distance, name):
    poses = [facing((i, 0.4 * i, 0), (0, 1, 0)) for i in range(6)]
    points = np.random.default_rng(0).uniform(-1, 1, (200, 3)) + np.array([2.5, distance + 1, 0])
    assert capture_of(poses, points=points).kind.name == name


def test_a_panorama_from_one_place_is_unbounded_and_a_glance_forward_facing():
    turn = [facing((0, 0, 0), (np.cos(a), np.sin(a), 0)) for a in np.arange(9) * 0.7]
    glance = [facing((0, 0, 0), (np.cos(a), np.sin(a), 0)) for a in np.arange(9) * 0.05]
    assert capture_of(turn).kind.name == UNBOUNDED
    assert capture_of(glance).kind.name == FORWARD


@pytest.mark.parametrize("change", [{"scale": 1e-6}, {"scale": 1e6}, {"shift": (1e6, 1e6, 0)}])
@pytest.mark.parametrize("poses", [ring(), row(), ring(arc=1.2)])
def test_size_and_place_do_not_matter(poses, change):
    assert capture_of(moved(poses, **change)).kind == capture_of(poses).kind


def test_user_may_override():
    kind = chosen_kind(UNBOUNDED)
    assert (kind.name, kind.overridden) == (UNBOUNDED, True)
    assert capture_of(row(), kind=kind).kind is kind


def test_auto_is_detected():
    assert capture_of(row(), kind=chosen_kind(AUTO)).kind.name == FORWARD


@pytest.mark.parametrize("build", [chosen_kind, lambda name: SceneKind(name, "")])
def test_other_kinds_are_refused(build):
    with pytest.raises(OptionInvalid, match="forward"):
        build("panorama")
