"""Training pixels: their rays and their colours."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from core.camera import Camera
from core.capture import View
from core.conventions import SUBPIXEL_OFFSETS_PX
from core.field.frame import Frame
from core.training.pixels import BACKGROUND_SHARE, NEAR_OBJECT, PixelPool, camera_rays_of
from tests.scenes import look_at_camera
from tests.unit.training.captures import ball, capture_of

FRAME = Frame(np.array([0.2, -0.1, 0.3]), 1.5)


def marked_views(rng: np.random.Generator, sizes=((20, 14), (17, 23))) -> list[View]:
    """Photos of unlike sizes and lenses; every pixel's colour is unique: its view, its column, its row."""
    views = []
    for index, (width, height) in enumerate(sizes):
        camera = look_at_camera(f"{index}", rng.normal(size=3) * 3, size_px=(width, height))
        lens = Camera(camera.name, camera.world_from_camera, (21.0, 25.0), (9.3, 7.9), (width, height))
        column, row = np.meshgrid(np.arange(width), np.arange(height))
        alpha = rng.integers(1, 256, (height, width))
        pixels = np.stack([np.full_like(column, index), column, row, alpha], -1)
        views.append(View(lens, pixels.astype(np.uint8)))
    return views


def marks(batch) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(view, column, row) of a batch's pixels."""
    straight = batch.color.cpu() / batch.alpha.cpu()[:, None] * 255
    return tuple(np.rint(straight.numpy()).astype(int).T)


def exact_directions(views: list[View], view, column, row, offset) -> np.ndarray:
    points = np.stack([column, row], -1) + 0.5 + offset
    return np.stack([views[v].camera.directions(p) for v, p in zip(view, points, strict=True)])


def test_sub_rays_pass_through_the_four_sub_pixels_of_their_pixel(rng, device):
    views = marked_views(rng)
    batch = PixelPool(views, FRAME, device).draw(0, 300, supersampled=True)
    place = marks(batch)
    assert set(place[0]) == {0, 1}
    directions = batch.directions.cpu().numpy().reshape(300, 4, 3)
    for s, offset in enumerate(SUBPIXEL_OFFSETS_PX):
        # Unit vectors in float32.
        np.testing.assert_allclose(directions[:, s], exact_directions(views, *place, offset), atol=1e-6)
    np.testing.assert_allclose(batch.centre_directions.cpu(), exact_directions(views, *place, 0.0), atol=1e-6)
    origins = np.stack([FRAME.to_scene(views[v].camera.position) for v in place[0]])
    np.testing.assert_allclose(batch.origins.cpu().reshape(300, 4, 3), np.repeat(origins[:, None], 4, 1), atol=1e-6)


def test_single_rays_pass_through_their_pixels_centre(rng, device):
    views = marked_views(rng)
    batch = PixelPool(views, FRAME, device).draw(0, 500, supersampled=False)
    # Unit vectors in float32.
    np.testing.assert_allclose(batch.directions.cpu(), exact_directions(views, *marks(batch), 0.0), atol=1e-6)
    np.testing.assert_array_equal(batch.centre_directions.cpu(), batch.directions.cpu())


def test_colours_are_the_photos_times_their_alpha(rng):
    views = marked_views(rng)
    batch = PixelPool(views, FRAME, "cpu").draw(0, 200, supersampled=False)
    for v, x, y, color, alpha in zip(*marks(batch), batch.color, batch.alpha, strict=True):
        premultiplied, expected = views[v].premultiplied()
        np.testing.assert_allclose(color, premultiplied[y, x], atol=1e-6)
        assert float(alpha) == pytest.approx(float(expected[y, x]))


def test_photos_without_alpha_are_opaque_everywhere(rng):
    capture = capture_of(ball(), alpha=False)
    batch = PixelPool(capture.train, FRAME, "cpu").draw(0, 500, supersampled=False)
    assert bool((batch.alpha == 1.0).all())


def test_smaller_photos_see_the_same_directions(rng):
    """Pixels of a photo made smaller cover the photo exactly, also where its size is no multiple of the factor."""
    views = marked_views(rng, sizes=((20, 14), (17, 23)))
    cameras = PixelPool(views, FRAME, "cpu", factor=3)._cameras
    expected = [(21 * 7 / 20, 25 * 5 / 14), (21 * 6 / 17, 25 * 8 / 23)]
    np.testing.assert_allclose(cameras.focal_px.numpy(), expected, rtol=1e-6)


def test_far_from_the_object_a_share_of_the_pixels_is_drawn(rng):
    image = np.zeros((100, 100, 4), np.uint8)
    image[40:60, 40:60] = 255
    view = View(look_at_camera("", (0, -4, 0.1), size_px=(100, 100)), image)
    pool = PixelPool([view], FRAME, "cpu")._pool
    near = np.zeros((100, 100), bool)
    near[38:62, 38:62] = True  # 2 % of the width around the object
    assert np.isin(np.flatnonzero(near), pool).all()
    share = (len(pool) - near.sum()) / (~near).sum()
    assert share == pytest.approx(BACKGROUND_SHARE, abs=0.02)


def chosen_slowly(views: list[View], seed: int) -> np.ndarray:
    """The oracle: all photos at once, in RGBA, with every pixel's number in 64 bits."""
    rng, drawn = np.random.default_rng([seed, 1]), []
    for view in views:
        alpha = view.premultiplied()[1]
        reach, near = max(1, round(NEAR_OBJECT * alpha.shape[1])), np.zeros(alpha.shape, bool)
        for y, x in np.argwhere(alpha > 0):
            near[max(0, y - reach) : y + reach + 1, max(0, x - reach) : x + reach + 1] = True
        lucky = rng.random(alpha.shape) < BACKGROUND_SHARE
        drawn.append(((near | lucky) & (True if view.ignored is None else ~view.ignored)).ravel())
    return np.flatnonzero(np.concatenate(drawn))


def without_alpha(view: View) -> View:
    return replace(view, image_u8=np.ascontiguousarray(view.image_u8[..., :3]))


def half_masked(view: View) -> View:
    return replace(view, ignored=view.camera.pixel_centres()[..., 1] > view.camera.size_px[1] / 2)


def half_empty(view: View) -> View:
    left = view.camera.pixel_centres()[..., :1] < view.camera.size_px[0] / 2
    return replace(view, image_u8=np.where(left, np.uint8(0), view.image_u8))


@pytest.mark.parametrize(
    "changes",
    [(half_empty, half_empty), (without_alpha, without_alpha), (half_empty, without_alpha), (half_masked, half_empty),
     (lambda view: half_masked(without_alpha(view)), without_alpha)],
)  # fmt: skip
def test_what_may_be_drawn_is_what_the_oracle_says(rng, changes):
    views = [change(view) for change, view in zip(changes, marked_views(rng, sizes=((60, 40), (37, 53))), strict=True)]
    pool, expected = PixelPool(views, FRAME, "cpu", seed=3), chosen_slowly(views, seed=3)
    np.testing.assert_array_equal(np.arange(pool.size) if pool._pool is None else pool._pool, expected)


def test_a_pixel_takes_no_more_bytes_than_it_must(rng):
    """What core/datasets/budget.py counts on."""
    opaque = [without_alpha(view) for view in marked_views(rng)]
    pool = PixelPool(opaque, FRAME, "cpu")
    assert (pool._pixels.shape[1], pool._pool) == (3, None)
    assert PixelPool([half_masked(view) for view in opaque], FRAME, "cpu")._pool.dtype == np.uint32


def test_a_batch_says_which_photo_each_pixel_is_of(rng):
    views = marked_views(rng)
    batch = PixelPool(views, FRAME, "cpu").draw(0, 200, supersampled=False)
    np.testing.assert_array_equal(batch.image, marks(batch)[0])


def test_the_same_seed_and_number_draw_the_same_pixels():
    views = marked_views(np.random.default_rng(0))
    one, same = (PixelPool(views, FRAME, "cpu", seed=3).draw(5, 50, supersampled=False) for _ in range(2))
    assert torch.equal(one.directions, same.directions)
    assert torch.equal(one.color, same.color)


@pytest.mark.parametrize("sizes", [((1, 1),), ((2, 1),), ((5, 3), (4, 4)), ((20, 14), (17, 23))])
def test_every_pixel_has_its_turn_before_any_has_two(rng, sizes):
    pool = PixelPool([without_alpha(view) for view in marked_views(rng, sizes)], FRAME, "cpu", seed=2)
    batches = [pool.draw(number, 1, supersampled=False) for number in range(pool.size)]
    assert len({tuple(np.concatenate(marks(batch))) for batch in batches}) == pool.size


def test_batches_of_any_size_go_on_where_the_last_one_ended(rng):
    views = marked_views(rng)
    pool = PixelPool(views, FRAME, "cpu", seed=1)
    whole = pool.draw(0, 60, supersampled=False)
    parts = [pool.draw(number, 20, supersampled=False) for number in range(3)]
    assert torch.equal(torch.cat([part.color for part in parts]), whole.color)


def test_a_batch_is_spread_over_the_photos_more_evenly_than_chance(rng):
    pool = PixelPool([without_alpha(view) for view in marked_views(rng, ((30, 30),) * 9)], FRAME, "cpu")
    for number in range(20):
        counts = np.bincount(pool.draw(number, 900, supersampled=False).image, minlength=9)
        # By chance a photo's share of 100 has a deviation of 9; this order's is off by its discrepancy, a few.
        assert np.abs(counts - 100).max() <= 4


def test_late_batches_are_drawn_exactly(rng):
    pool = PixelPool(marked_views(rng), FRAME, "cpu")
    number, count = 10**12 + 7, 64
    index = [(pool._phase + (number * count + k) * pool._stride) % pool.size for k in range(count)]
    place = np.stack(marks(pool.draw(number, count, supersampled=False)), -1)
    expected = np.stack(marks(pool.draw(0, pool.size, supersampled=False)), -1)  # turn k shows index of turn k
    turns = {(pool._phase + k * pool._stride) % pool.size: k for k in range(pool.size)}
    np.testing.assert_array_equal(place, expected[[turns[i] for i in index]])


def test_rays_of_a_camera_pass_through_its_pixel_centres(rng, device):
    camera = marked_views(rng)[0].camera
    origins, directions = camera_rays_of(camera, FRAME, device)
    expected = camera.directions(camera.pixel_centres()).reshape(-1, 3)
    np.testing.assert_allclose(directions.cpu(), expected, atol=1e-6)
    np.testing.assert_allclose(origins.cpu(), np.tile(FRAME.to_scene(camera.position), (len(expected), 1)), atol=1e-6)
