"""The quad mesh: which quads there are, and where their vertices may be."""

import numpy as np
import pytest
import torch

from core.errors import TrainingFailed
from core.field.bricks import from_bricks
from core.mesh.quad_mesh import VERTEX_REACH, QuadMesh, patch_weights
from tests.unit.kernels.meshes import build_mesh, random_mesh

UNKNOWN = np.nan


def cells_of(mesh: QuadMesh) -> np.ndarray:
    """[Q, 4, 3] int, the cells of each quad's vertices."""
    return np.stack(np.unravel_index(mesh.kept[mesh.quads], (mesh.cells,) * 3), -1)


def built(solid: np.ndarray, centroid=None) -> QuadMesh:
    return build_mesh(solid, np.full((*solid.shape, 3), UNKNOWN) if centroid is None else centroid, "cpu")


def test_the_four_cells_of_a_quad_share_an_edge(rng):
    cells = cells_of(random_mesh(rng))
    extent = cells.max(1) - cells.min(1)
    assert (np.sort(extent, 1) == [0, 1, 1]).all()
    assert all(len(np.unique(quad, axis=0)) == 4 for quad in cells)


def test_opposite_corners_of_a_quad_lie_in_opposite_cells(rng):
    cells = cells_of(random_mesh(rng))
    for a, b in ((0, 3), (1, 2)):
        assert (np.abs(cells[:, a] - cells[:, b]).sum(-1) == 2).all()


def test_there_is_one_quad_for_every_inner_edge_between_four_solid_cells(rng):
    solid = rng.random((7, 7, 7)) < 0.7
    inner = np.zeros_like(solid)
    inner[1:-1, 1:-1, 1:-1] = solid[1:-1, 1:-1, 1:-1]
    expected = set()
    for first in np.ndindex(6, 6, 6):
        for u, v in (((1, 0, 0), (0, 1, 0)), ((1, 0, 0), (0, 0, 1)), ((0, 1, 0), (0, 0, 1))):
            around = [tuple(np.add(first, np.multiply(a, u) + np.multiply(b, v))) for a in (0, 1) for b in (0, 1)]
            if all(inner[cell] for cell in around):
                expected.add(frozenset(around))
    found = [frozenset(tuple(int(n) for n in cell) for cell in quad) for quad in cells_of(built(solid))]
    assert len(found) == len(set(found))
    assert set(found) == expected


def test_every_vertex_belongs_to_some_quad(rng):
    mesh = random_mesh(rng, share=0.5)
    np.testing.assert_array_equal(np.unique(mesh.quads), np.arange(len(mesh.kept)))


def test_vertices_start_where_rays_saw_something_within_reach_of_their_cell(rng):
    solid = np.ones((6, 6, 6), bool)
    centroid = rng.uniform(-1, 1, (6, 6, 6, 3))
    centroid[rng.random((6, 6, 6)) < 0.3] = UNKNOWN
    mesh = built(solid, centroid)
    centres = mesh.centres()
    seen = centroid.reshape(-1, 3)[mesh.kept]
    reach = VERTEX_REACH * mesh.cell_size
    expected = np.clip(np.where(np.isnan(seen), centres, seen), centres - reach, centres + reach)
    np.testing.assert_allclose(mesh.vertices, expected, atol=1e-6)  # float32 positions up to 1


def test_cells_at_the_rim_of_the_cube_have_no_vertex():
    cells = cells_of(built(np.ones((6, 6, 6), bool)))
    assert cells.min() == 1
    assert cells.max() == 4


@pytest.mark.parametrize(
    "solid", [np.zeros((6, 6, 6), bool), np.eye(6, dtype=bool)[:, :, None] & np.eye(6, dtype=bool)]
)
def test_a_mesh_without_quads_is_refused(solid):
    with pytest.raises(TrainingFailed, match="surface"):
        built(solid)


def test_leaving_out_quads_keeps_the_vertices(rng):
    mesh = random_mesh(rng)
    keep = rng.random(len(mesh.quads)) < 0.5
    fewer = mesh.with_quads(keep)
    np.testing.assert_array_equal(fewer.quads, mesh.quads[keep])
    assert fewer.vertices is mesh.vertices


@pytest.mark.parametrize("K", [2, 3, 5, 8])
def test_patch_weights_sum_to_one_and_give_back_the_corners(K):
    weights = patch_weights(K)
    assert weights.min() >= 0
    np.testing.assert_allclose(weights.sum(-1), 1.0, rtol=1e-12)
    corners = weights[[0, 0, -1, -1], [0, -1, 0, -1]]
    np.testing.assert_allclose(corners, np.eye(4), atol=1e-12)


def test_patch_weights_lie_on_the_two_triangles(rng):
    K = 6
    corners = rng.normal(size=(4, 3))
    points = patch_weights(K) @ corners
    for i, j in np.ndindex(K, K):
        a, b = i / (K - 1), j / (K - 1)
        middle, share = (1, b - a) if b >= a else (2, a - b)
        expected = (1 - max(a, b)) * corners[0] + share * corners[middle] + min(a, b) * corners[3]
        np.testing.assert_allclose(points[i, j], expected, atol=1e-12)


def in_order_of_cells(kernel, cells: int) -> tuple[np.ndarray, np.ndarray]:
    """(slot, distance) of each cell, by its flat index."""
    held = (torch.from_numpy(a.numpy()) for a in (kernel.cell_slot, kernel.cell_distance))
    slot, distance = (from_bricks(places, cells).reshape(-1).numpy() for places in held)
    return slot, distance


def test_each_cell_lists_exactly_the_quads_that_use_its_vertex(rng):
    mesh = random_mesh(rng)
    kernel = mesh.kernel_mesh("cpu")
    start, listed = kernel.slot_start.numpy(), kernel.slot_quads.numpy()
    slot_of, distance = in_order_of_cells(kernel, mesh.cells)
    for slot, cell in enumerate(mesh.kept):
        assert slot_of[cell] == slot
        assert distance[cell] == 0
        quads = listed[start[slot] : start[slot + 1]]
        assert sorted(quads) == np.flatnonzero((mesh.quads == slot).any(1)).tolist()
        assert len(quads) <= 12
    empty = np.setdiff1d(np.arange(mesh.cells**3), mesh.kept)
    assert (distance[empty] > 0).all()


def test_empty_cells_tell_at_most_the_distance_to_the_nearest_kept_cell(rng):
    mesh = random_mesh(rng, cells=12, share=0.35)
    _, distance = in_order_of_cells(mesh.kernel_mesh("cpu"), mesh.cells)
    kept = np.stack(np.unravel_index(mesh.kept, (12,) * 3), -1)
    for cell in np.flatnonzero(distance):
        place = np.array(np.unravel_index(cell, (12,) * 3))
        assert 1 <= distance[cell] <= np.abs(kept - place).max(1).min()


def test_the_kernels_mesh_sees_vertices_that_move(rng):
    mesh = random_mesh(rng)
    kernel = mesh.kernel_mesh("cpu")
    mesh.vertices.add_(0.001)
    assert torch.equal(torch.from_numpy(kernel.vertices.numpy()), mesh.vertices)
