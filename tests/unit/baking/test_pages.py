"""Packing quads into pages, and finding their texels again."""

import numpy as np
import pytest

from core.baked import BakedScene
from core.baking import pages as packing
from core.baking.pages import pack_pages, page_size, patches_of
from core.camera import Camera
from core.conventions import bytes_from_features
from core.kernels.surfaces import TEXEL_KERNELS
from core.mesh.quad_mesh import patch_weights
from core.render.reference import visibility
from core.training.tracer import Tracer
from tests.scenes import look_at_camera, random_network
from tests.unit.kernels.meshes import random_mesh, texels_of
from tests.unit.kernels.rays import batch_of


def random_patches(rng: np.random.Generator, count: int, K: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(corners, features_u8, colors_u8) of quads."""
    return (
        rng.normal(size=(count, 4, 3)),
        rng.integers(0, 256, (count, K, K, 8), np.uint8),
        rng.integers(0, 256, (count, K, K, 3), np.uint8),
    )


@pytest.mark.parametrize(("count", "K"), [(1, 2), (3, 5), (40, 7), (61, 4)])
def test_patches_come_back_as_they_were_packed(rng, count, K):
    corners, features, colors = random_patches(rng, count, K)
    pages = pack_pages(corners, features, colors)
    counts = [len(page.triangles) // 2 for page in pages]
    np.testing.assert_array_equal(patches_of([page.features_u8 for page in pages], counts, K), features)
    np.testing.assert_array_equal(patches_of([page.colors_u8 for page in pages], counts, K), colors)


def test_what_one_page_cannot_hold_goes_to_further_pages(rng, monkeypatch):
    monkeypatch.setattr(packing, "MAX_PAGE_SIZE_PX", 32)
    corners, features, colors = random_patches(rng, 100, 5)
    pages = pack_pages(corners, features, colors)
    counts = [len(page.triangles) // 2 for page in pages]
    assert counts == [36, 36, 28]  # 6 x 6 patches of 5 x 5 texels fit into 32 x 32
    assert all(max(page.features_u8.shape[:2]) <= 32 for page in pages)
    np.testing.assert_array_equal(patches_of([page.features_u8 for page in pages], counts, 5), features)
    positions = np.concatenate([page.positions for page in pages]).reshape(-1, 4, 3)
    np.testing.assert_array_equal(positions, corners.astype(np.float32))


@pytest.mark.parametrize("K", [2, 5, 7, 17, 64])
@pytest.mark.parametrize("count", [1, 2, 3, 10, 100, 4000])
def test_a_page_is_the_smallest_that_holds_the_patches(count, K):
    height, width = page_size(count, K)
    assert (height // K) * (width // K) >= count
    assert height in (width, width // 2)
    smaller = (width // 2, width) if height == width else (width // 2, width // 2)
    assert (smaller[0] // K) * (smaller[1] // K) < count
    assert all(n & (n - 1) == 0 for n in (height, width))


def test_a_full_page_is_the_largest_allowed():
    assert page_size((4096 // 7) ** 2, 7) == (4096, 4096)


@pytest.mark.parametrize("K", [2, 5])
def test_texture_coordinates_of_corners_are_the_centres_of_the_corner_texels(rng, K):
    corners, features, colors = random_patches(rng, 9, K)
    (page,) = pack_pages(corners, features, colors)
    height, width = page.features_u8.shape[:2]
    place = page.texcoords.astype(float) * [width, height]
    np.testing.assert_allclose(place % 1.0, 0.5, atol=1e-4)  # float32 of up to 4096 texels
    column, row = np.floor(place).astype(int).reshape(-1, 4, 2).transpose(2, 0, 1)
    corner_texels = features[:, [0, 0, -1, -1], [0, -1, 0, -1]]
    np.testing.assert_array_equal(page.features_u8[row, column], corner_texels)


def test_the_two_triangles_share_the_diagonal_from_corner_00_to_11(rng):
    (page,) = pack_pages(*random_patches(rng, 3, 2))
    for index, (first, second) in enumerate(page.triangles.reshape(-1, 2, 3)):
        assert set(first) & set(second) == {4 * index, 4 * index + 3}
        assert set(first) | set(second) == set(range(4 * index, 4 * index + 4))


def test_feature_bytes_keep_to_their_limits():
    features = np.array([[0.0] * 8, [1.0] * 8, [-5.0] * 8, [7.0] * 8, [0.5 / 255] * 8, [0.4] * 8])
    opaque = np.array([True, True, True, True, True, False])
    found = bytes_from_features(features, opaque)
    assert found.dtype == np.uint8
    assert found[:5, 0].tolist() == [1, 255, 1, 255, 1]
    assert found[:5, 1].tolist() == [0, 255, 0, 255, 0]
    assert not found[5].any()


def test_bytes_are_within_half_a_step_of_the_features(rng):
    features = rng.uniform(1 / 255, 1, (1000, 8))
    found = bytes_from_features(features, np.ones(1000, bool))
    assert np.abs(found / 255.0 - features).max() <= 0.5 / 255 + 1e-12


def packed_scene(mesh, opaque: np.ndarray, features: np.ndarray) -> BakedScene:
    corners = mesh.vertices.cpu().numpy()[mesh.quads].astype(float)
    features_u8 = bytes_from_features(features, opaque)
    pages = pack_pages(corners, features_u8, np.zeros((*opaque.shape, 3), np.uint8))
    return BakedScene(pages, random_network(np.random.default_rng(0)), (1.0, 1.0, 1.0), np.eye(4))


def rays_of(camera: Camera) -> tuple[np.ndarray, np.ndarray]:
    directions = camera.directions(camera.pixel_centres()).reshape(-1, 3)
    return np.broadcast_to(camera.position, directions.shape), directions


@pytest.mark.parametrize("K", [2, 5])
def test_training_and_rendering_see_the_same_texel(rng, device, K):
    mesh = random_mesh(rng, cells=9, share=0.6, device=device)
    shape = (len(mesh.quads), K, K)
    opaque = rng.random(shape) < 0.6
    camera = look_at_camera("any", (1.5, -2.4, 1.3), size_px=(80, 64))
    seen = visibility(packed_scene(mesh, opaque, rng.random((*shape, 8))), camera)

    # The trainer's texels tell their own number: quad, row and column, as features (each below 2^24, so exact).
    number = np.stack(np.unravel_index(np.arange(opaque.size), shape), -1).reshape(*shape, 3)
    features = np.concatenate([number, np.zeros((*shape, 5))], -1)
    tracer = Tracer(mesh, TEXEL_KERNELS, 80 * 64, 1, 64)
    surface = texels_of(opaque.astype(float), features, device)
    _, (F, A) = tracer.forward(batch_of(*rays_of(camera), device), surface, binary_only=True)
    hit = A.cpu().numpy().reshape(64, 80) > 0
    quad, i, j = F.cpu().numpy().reshape(64, 80, -1)[..., :3].astype(int).transpose(2, 0, 1)

    (page,) = packed_scene(mesh, opaque, features).pages
    per_row = page.features_u8.shape[1] // K
    same = hit == seen.hit
    both = hit & seen.hit
    same[both] &= (
        (quad[both] == seen.triangle[both] // 2)
        & (i[both] == seen.row[both] - quad[both] // per_row * K)
        & (j[both] == seen.column[both] - quad[both] % per_row * K)
    )
    assert both.mean() > 0.1
    # A sample within 1e-6 of an edge of a texel or quad may fall on its other side in float32.
    assert (~same).mean() < 1e-3


def test_baked_points_are_the_places_that_a_texel_is_shown_at(rng):
    """The texel (i, j) is looked up at a = i / (K - 1), b = j / (K - 1): where `patch_weights` samples the volume."""
    K, corners = 4, rng.normal(size=(1, 4, 3))
    (page,) = pack_pages(corners, np.zeros((1, K, K, 8), np.uint8), np.zeros((1, K, K, 3), np.uint8))
    height, width = page.features_u8.shape[:2]
    uv = patch_weights(K) @ page.texcoords.astype(float)
    np.testing.assert_allclose(uv[..., 0] * width, np.broadcast_to(np.arange(K) + 0.5, (K, K)), atol=1e-5)
    np.testing.assert_allclose(uv[..., 1] * height, np.broadcast_to(np.arange(K)[:, None] + 0.5, (K, K)), atol=1e-5)


def test_patches_of_several_pages_come_in_the_order_of_the_quads():
    images = [np.arange(16).reshape(4, 4), 100 + np.arange(16).reshape(4, 4)]
    found = patches_of(images, [4, 2], 2)
    assert found.shape == (6, 2, 2)
    assert found[:, 0, 0].tolist() == [0, 2, 8, 10, 100, 102]
