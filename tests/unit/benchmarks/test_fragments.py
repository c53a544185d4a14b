"""Every fragment of a scene, and depth scores."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks import fragments as module
from benchmarks.depth_scores import depth_scores
from benchmarks.fragments import Fragments, fragments_of
from core.render.reference import visibility
from core.render.visibility import NOTHING


def fragments(pixel, distance, opaque=None, size_px=(4, 3)) -> Fragments:
    solid = np.ones(len(pixel), bool) if opaque is None else np.array(opaque)
    return Fragments(size_px, np.array(pixel, int), np.array(distance, float), solid)


@pytest.mark.parametrize("pairs_at_once", [1 << 20, 64], ids=["in one go", "in parts"])
def test_the_nearest_opaque_fragment_is_what_the_reference_renderer_sees(scene, monkeypatch, pairs_at_once):
    monkeypatch.setattr(module, "PAIRS_AT_ONCE", pairs_at_once)
    for camera in scene.cameras:
        found = fragments_of(scene, camera)
        seen = visibility(scene, camera)
        np.testing.assert_array_equal(np.isfinite(found.front()), seen.page != NOTHING)
        assert (found.layers() <= found.drawn()).all()
        np.testing.assert_array_equal(found.layers() > 0, seen.hit)


def test_fragments_lie_at_their_distance_along_the_ray(scene):
    camera = scene.cameras[0]
    front = fragments_of(scene, camera).front()
    seen = visibility(scene, camera)
    directions = camera.directions(camera.pixel_centres())
    for y, x in np.argwhere(seen.hit)[::7]:
        page = scene.pages[seen.page[y, x]]
        corners = page.positions[page.triangles[seen.triangle[y, x]]].astype(float)
        normal = np.cross(corners[1] - corners[0], corners[2] - corners[0])
        point = camera.position + front[y, x] * directions[y, x]
        # The point lies in the triangle's plane, to float64's rounding of unit-sized scenes.
        assert abs((point - corners[0]) @ normal) < 1e-9 * max(np.linalg.norm(normal), 1.0)


def test_a_camera_that_sees_nothing_has_no_fragments(scene):
    camera = scene.cameras[0]
    turned = camera.world_from_camera.copy()
    turned[:3, [0, 2]] *= -1  # about face
    found = fragments_of(scene, replace(camera, world_from_camera=turned))
    assert len(found.pixel) == 0
    assert not np.isfinite(found.front()).any()


def test_layers_count_opaque_fragments_and_drawn_counts_holes_too():
    found = fragments([5, 5, 5, 6], [2.0, 1.0, 3.0, 1.0], [True, False, True, False])
    assert found.layers()[1, 1] == 2
    assert found.drawn()[1, 1] == 3
    assert found.front()[1, 1] == 2.0
    assert found.layers()[1, 2] == 0
    assert found.front()[1, 2] == np.inf


def test_perfect_depth_scores_nothing_wrong():
    truth = np.full((3, 4), 2.0)
    scores = depth_scores([fragments(range(12), [2.0] * 12)], [truth], 1.0)
    assert (scores.median, scores.most, scores.far_off, scores.floaters, scores.holes) == (0, 0, 0, 0, 0)
    assert scores.overdraw == scores.fragments == 1.0


def test_depth_errors_are_shares_of_the_scenes_size():
    truth = np.full((3, 4), 2.0)
    scores = depth_scores([fragments(range(12), [2.0] * 9 + [2.5] * 3)], [truth], 10.0)
    assert scores.median == 0.0
    assert scores.most == pytest.approx(0.05)
    assert scores.far_off == pytest.approx(0.25)


def test_floaters_and_holes_count_only_away_from_the_true_outline():
    truth = np.full((5, 7), np.inf)
    truth[:, :3] = 1.0
    everywhere = depth_scores([fragments(range(35), [1.0] * 35, size_px=(7, 5))], [truth], 1.0)
    assert everywhere.floaters == pytest.approx(15 / 35)  # of 20 pixels, 5 lie at the outline
    assert everywhere.holes == 0.0
    nowhere = depth_scores([fragments([], [], size_px=(7, 5))], [truth], 1.0)
    assert nowhere.holes == pytest.approx(10 / 15)
    assert nowhere.floaters == 0.0
    assert np.isnan(nowhere.median)
