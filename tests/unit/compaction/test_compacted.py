"""Compacted scenes show what the scene shows, within the bound they were asked for."""

from dataclasses import replace

import numpy as np
import pytest

from core.baked import BakedScene
from core.conventions import is_opaque
from core.render.reference import render_deferred
from exporters.compaction import PHONE, WEB, Quality, compacted, repacked
from exporters.compaction.compaction import rounded_colors
from exporters.compaction.filling import filled, nearest_known
from tests.scenes import random_network, random_scene
from tests.unit.compaction.lookups import Lookups, color_psnr, random_points

POINTS = random_points(80)
# The colours are measured from all directions; the bound holds from where the cameras are.
SLACK_DB = 1.5


@pytest.mark.parametrize("decibels", [35.0, 44.0])
def test_colours_are_within_the_bound(scene: BakedScene, decibels: float) -> None:
    after = compacted(scene, replace(WEB, color_db=decibels))
    measured = color_psnr(Lookups(scene, POINTS), Lookups(after, POINTS))
    assert decibels - SLACK_DB <= measured <= decibels + 4  # and not much better, which would waste bytes


@pytest.mark.parametrize("seed", range(3))
def test_random_scenes_are_within_the_bound(seed: int) -> None:
    scene = replace(random_scene(np.random.default_rng(seed)), cameras=())  # its only one sees little of it
    after = compacted(scene)
    assert color_psnr(Lookups(scene, POINTS), Lookups(after, POINTS)) >= WEB.color_db - SLACK_DB


def test_web_moves_no_hole(scene: BakedScene) -> None:
    texels, others = Lookups(scene, POINTS).paired(Lookups(compacted(scene), POINTS))
    np.testing.assert_array_equal(is_opaque(texels), is_opaque(others))


def test_picture_is_better_than_its_texels(scene: BakedScene) -> None:
    after, camera = compacted(scene), scene.cameras[0]
    before, now = render_deferred(scene, camera), render_deferred(after, camera)
    shown = before[..., 3] > 0
    assert -10 * np.log10(((before - now)[shown] ** 2).mean()) >= WEB.color_db


def test_phone_has_a_fraction_of_the_texels(scene: BakedScene) -> None:
    before, after = (
        sum(page.features_u8[..., 0].size for page in each.pages) for each in (scene, compacted(scene, PHONE))
    )
    assert after <= before / 4
    assert color_psnr(Lookups(scene, POINTS), Lookups(compacted(scene, PHONE), POINTS)) > 20


def test_the_same_scene_gives_the_same_pages(scene: BakedScene) -> None:
    for page, other in zip(compacted(scene).pages, compacted(scene).pages, strict=True):
        np.testing.assert_array_equal(page.features_u8, other.features_u8)


def test_page_of_loose_triangles_is_recoded_as_it_is(scene: BakedScene) -> None:
    page = scene.pages[0]
    loose = replace(scene, pages=(replace(page, triangles=page.triangles[:-1]),), cameras=())
    after = compacted(loose)
    assert after.pages[0].features_u8.shape == page.features_u8.shape
    assert color_psnr(Lookups(loose, POINTS), Lookups(after, POINTS)) >= WEB.color_db - SLACK_DB
    assert not after.pages[0].features_u8[~is_opaque(page.features_u8)].any()


def test_scene_without_cameras_is_seen_from_everywhere(scene: BakedScene) -> None:
    after = compacted(replace(scene, cameras=()))
    assert color_psnr(Lookups(scene, POINTS), Lookups(after, POINTS)) >= WEB.color_db - SLACK_DB


def test_scene_of_holes_only_is_repacked(scene: BakedScene) -> None:
    holes = tuple(replace(page, features_u8=np.zeros_like(page.features_u8)) for page in scene.pages)
    assert compacted(replace(scene, pages=holes)).quad_count == 1


def test_degenerate_triangles_do_no_harm(scene: BakedScene) -> None:
    points = tuple(replace(page, positions=np.zeros_like(page.positions)) for page in scene.pages)
    assert compacted(replace(scene, pages=points)).quad_count == scene.quad_count


@pytest.mark.parametrize("gain", [1e-6, 1e6])
def test_extreme_networks_stay_finite(scene: BakedScene, gain: float) -> None:
    extreme = replace(scene, network=random_network(np.random.default_rng(1), gain))
    after = compacted(extreme, Quality(40.0, 40.0))
    assert all(np.isfinite(weight).all() for weight in after.network.weights)


@pytest.mark.parametrize("decibels", [30.0, 36.0, 60.0])
def test_rounded_colours_reach_their_psnr(rng: np.random.Generator, decibels: float) -> None:
    colors = rng.integers(0, 256, (200, 200, 3)).astype(np.uint8)
    error = (rounded_colors(colors, decibels).astype(float) - colors) / 255
    assert -10 * np.log10(max((error**2).mean(), 1e-12)) >= decibels - 0.3


def test_holes_take_the_nearest_value_of_their_row() -> None:
    row = np.array([[[[0], [5], [0], [0], [9], [0]]]], np.uint8)
    known = row[..., 0] > 0
    assert filled(row, known).ravel().tolist() == [5, 5, 5, 9, 9, 9]


def test_rows_of_holes_take_the_nearest_row() -> None:
    patch = np.array([[[[0]], [[4]], [[0]], [[0]]]], np.uint8)
    assert filled(patch, patch[..., 0] > 0).ravel().tolist() == [4, 4, 4, 4]


def test_known_texels_are_never_filled(rng: np.random.Generator) -> None:
    texels, known = rng.integers(0, 256, (20, 5, 5, 11)).astype(np.uint8), rng.random((20, 5, 5)) < 0.4
    known[3] = False
    np.testing.assert_array_equal(filled(texels, known)[known], texels[known])
    np.testing.assert_array_equal(filled(texels, known)[3], texels[3])


def test_holes_take_what_the_text_says(rng: np.random.Generator) -> None:
    texels, known = rng.integers(0, 99, (60, 4, 5, 2), dtype=np.uint8), rng.random((60, 4, 5)) < 0.2
    found = filled(texels, known)
    for patch, there, result in zip(texels, known, found, strict=True):
        if not there.any():
            np.testing.assert_array_equal(result, patch)
            continue
        rows = np.flatnonzero(there.any(1))
        for y in range(4):
            row = rows[np.abs(rows - y).argmin()]
            columns = np.flatnonzero(there[row])
            for x in range(5):
                np.testing.assert_array_equal(result[y, x], patch[row, columns[np.abs(columns - x).argmin()]])


def test_nearest_known_is_nearest(rng: np.random.Generator) -> None:
    known = rng.random((50, 9)) < 0.3
    for row, nearest in zip(known, nearest_known(known), strict=True):
        at = np.flatnonzero(row)
        for place in range(9):
            distance = np.abs(at - place).min() if len(at) else 0
            assert abs(int(nearest[place]) - place) == distance


def test_scene_of_which_nothing_is_worth_its_bytes_stays_whole(scene: BakedScene) -> None:
    after = compacted(scene, replace(PHONE, hole_cost=0.0))
    assert after.quad_count == repacked(scene).quad_count
    np.testing.assert_array_equal(after.pages[0].features_u8, repacked(scene).pages[0].features_u8)
