"""Repacking changes pages, not what any lookup finds."""

from dataclasses import replace

import numpy as np
import pytest

from core.baked import BakedScene, Page
from core.conventions import MAX_PAGE_SIZE_PX, is_opaque
from core.render.reference import render_deferred
from exporters.compaction import repacked
from exporters.compaction.packing import packed, shelves
from exporters.compaction.quads import Patches, Quads, quads_of
from tests.scenes import random_scene, tiny_scene
from tests.unit.compaction.lookups import Lookups, random_points

POINTS = random_points(60)


def test_every_lookup_on_every_triangle_finds_the_same_texel(scene: BakedScene) -> None:
    before, after = (Lookups(each, POINTS) for each in (scene, repacked(scene)))
    texels, others = before.paired(after)
    assert before.triangles() == after.triangles()
    assert len(texels) > 90 * len(POINTS) * 0.9
    np.testing.assert_array_equal(texels, others)


@pytest.mark.parametrize("seed", range(3))
def test_random_scenes_keep_their_lookups(seed: int) -> None:
    scene = random_scene(np.random.default_rng(seed))
    before, after = (Lookups(each, POINTS) for each in (scene, repacked(scene)))
    np.testing.assert_array_equal(*before.paired(after))


def test_pictures_stay_the_same(scene: BakedScene) -> None:
    camera = scene.cameras[0]
    difference = np.abs(render_deferred(scene, camera) - render_deferred(repacked(scene), camera)).max(-1)
    assert (difference > 0).mean() < 0.001  # samples on a texel's border, where float32 decides


def test_pages_are_as_small_as_will_do(scene: BakedScene) -> None:
    # 49 patches of 9 x 9 fit; the two pages had 16384 texels.
    (page,) = repacked(scene).pages
    assert page.features_u8.shape[:2] == (64, 64)


def test_repacking_again_changes_nothing_more(scene: BakedScene) -> None:
    once = repacked(scene)
    for page, other in zip(once.pages, repacked(once).pages, strict=True):
        np.testing.assert_array_equal(page.features_u8, other.features_u8)
        np.testing.assert_array_equal(page.texcoords, other.texcoords)


def test_quads_that_are_all_hole_go(scene: BakedScene) -> None:
    page = scene.pages[0]
    features = page.features_u8.copy()
    features[:9, :18] = 0  # the first two patches
    emptied = replace(scene, pages=(replace(page, features_u8=features), *scene.pages[1:]))
    assert repacked(emptied).quad_count == scene.quad_count - 2


def test_scene_of_holes_only_keeps_a_quad(scene: BakedScene) -> None:
    holes = [replace(page, features_u8=np.zeros_like(page.features_u8)) for page in scene.pages]
    assert repacked(replace(scene, pages=tuple(holes))).quad_count == 1


def test_flat_patches_take_one_texel_and_are_shared(scene: BakedScene) -> None:
    flat = [
        replace(page, features_u8=np.full_like(page.features_u8, 7), colors_u8=np.full_like(page.colors_u8, 9))
        for page in scene.pages
    ]
    (page,) = repacked(replace(scene, pages=tuple(flat))).pages
    assert page.features_u8.shape == (1, 1, 8)
    assert page.features_u8.ravel().tolist() == [7] * 8
    assert len(page.triangles) == 2 * scene.quad_count


def test_patch_that_changes_along_one_axis_keeps_that_axis(scene: BakedScene) -> None:
    page = scene.pages[0]
    features = page.features_u8.copy()
    features[:9, :9] = np.arange(1, 10, dtype=np.uint8)[None, :, None]
    colors = page.colors_u8.copy()
    colors[:9, :9] = 0
    changed = replace(scene, pages=(replace(page, features_u8=features, colors_u8=colors),))
    after = repacked(changed)
    assert sum(int(is_opaque(p.features_u8).sum()) for p in after.pages) < int(is_opaque(features).sum()) - 70
    np.testing.assert_array_equal(*Lookups(changed, POINTS).paired(Lookups(after, POINTS)))


def test_page_of_loose_triangles_stays_as_it_is(scene: BakedScene) -> None:
    page = scene.pages[0]
    loose = replace(page, triangles=page.triangles[:-1])
    assert quads_of(loose) is None
    assert repacked(replace(scene, pages=(loose,))).pages == (loose,)


@pytest.mark.parametrize("moved", [0.2, -0.2])
def test_corners_off_the_texels_centres_are_no_patch(scene: BakedScene, moved: float) -> None:
    page = scene.pages[0]
    width = page.features_u8.shape[1]
    shifted = page.texcoords + np.array([moved / width, 0], np.float32)
    assert quads_of(replace(page, texcoords=shifted.astype(np.float32))) is None


def test_skewed_texture_coordinates_are_no_patch(scene: BakedScene) -> None:
    page = scene.pages[0]
    skewed = page.texcoords.copy()
    skewed[0, 0] += np.float32(3 / page.features_u8.shape[1])
    assert quads_of(replace(page, texcoords=skewed)) is None


def test_every_patch_is_within_its_page_and_none_overlap() -> None:
    rng = np.random.default_rng(3)
    sizes = rng.integers(1, 30, (400, 2))
    places = shelves(sizes[np.lexsort((-sizes[:, 1], -sizes[:, 0]))], (256, 512))
    ordered = sizes[np.lexsort((-sizes[:, 1], -sizes[:, 0]))][: len(places)]
    taken = np.zeros((256, 512), int)
    for (top, left), (height, width) in zip(places, ordered, strict=True):
        assert top + height <= 256
        assert left + width <= 512
        taken[top : top + height, left : left + width] += 1
    assert taken.max() == 1
    assert len(places) > 300  # 96 % of 256 x 512 would hold 540 of average size


def test_more_than_a_page_holds_goes_to_further_pages() -> None:
    side = 1024
    sizes = np.full((17, 2), side)
    texels = np.repeat(np.arange(1, 18, dtype=np.uint8), side * side)[:, None].repeat(11, 1)
    pages = packed(_quads(sizes, texels))
    assert [page.features_u8.shape[:2] for page in pages] == [(MAX_PAGE_SIZE_PX, MAX_PAGE_SIZE_PX), (side, side)]
    assert [len(page.triangles) for page in pages] == [32, 2]


def test_second_small_page_is_better_than_a_half_empty_one() -> None:
    sizes = np.full((5, 2), 1024)
    pages = packed(_quads(sizes, np.ones((5 << 20, 11), np.uint8)))
    assert [page.features_u8.shape[:2] for page in pages] == [(2048, 2048), (1024, 1024)]


def test_small_scenes_take_one_page() -> None:
    sizes = np.full((70, 2), 8)  # 64 fill 64 x 64
    pages = packed(_quads(sizes, np.ones((70 * 64, 11), np.uint8)))
    assert [page.features_u8.shape[:2] for page in pages] == [(64, 128)]


def _quads(sizes: np.ndarray, texels: np.ndarray) -> Quads:
    count = len(sizes)
    ends = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], bool)
    return Quads(
        np.zeros((count, 4, 3), np.float32),
        np.tile(ends, (count, 1, 1)),
        np.tile(np.array([[0, 1, 2], [0, 2, 3]], np.uint32), (count, 1, 1)),
        np.arange(count),
        Patches(sizes, texels),
    )


def test_scene_made_by_hand_is_made_of_quads() -> None:
    for page in tiny_scene().pages:
        quads = quads_of(page)
        assert isinstance(page, Page)
        assert quads is not None
        assert len(quads) == len(page.triangles) // 2
        np.testing.assert_array_equal(quads.patches.sizes, 9)
