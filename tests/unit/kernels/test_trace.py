"""Tracing rays through the grid of cells, against trying every triangle."""

import numpy as np
import pytest
import torch

from core.kernels.surfaces import TEXEL_KERNELS, Texels
from core.kernels.trace import OPAQUE
from core.mesh.quad_mesh import QuadMesh
from core.oracles.trace import RayHits
from core.oracles.trace import trace as exact_trace
from core.training.tracer import Tracer
from tests.unit.kernels.meshes import clear_texels, exact, random_mesh, sheet_mesh, texels_of, with_vertices
from tests.unit.kernels.rays import (
    as_float32,
    axis_rays,
    batch_of,
    inside_rays,
    joined,
    plane_rays,
    random_rays,
    unit,
)

NEAR = 1e-3
# A hit this near (in barycentric weight) to a triangle's edge, or two hits this near to one another, may go either way
# in float32: positions of order 1 are resolved to 1e-7, edges are a tenth of that and more.
AMBIGUOUS = 1e-5


def traced(mesh: QuadMesh, rays, surface=None, *, capacity: int = 64, binary_only: bool = False):
    """The tracer after it has traced rays; through everything, unless a surface stops them."""
    device = str(mesh.vertices.device)
    tracer = Tracer(mesh, TEXEL_KERNELS, len(rays[0]), 1, capacity)
    tracer.forward(batch_of(*rays, device), surface or clear_texels(mesh, device), binary_only=binary_only)
    return tracer


def hits_of(tracer: Tracer, ray: int) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor]:
    """(quad, t, ab) of a ray."""
    n = int(tracer.count[ray])
    return tuple(a[ray, :n].cpu() for a in (tracer.quad, tracer.t, tracer._ab))


def oracle_hits(mesh: QuadMesh, rays, index: int, margin: float = 0.0) -> RayHits:
    ray = (torch.from_numpy(a[index]).double() for a in rays)
    return exact_trace(*exact(mesh), *ray, near=NEAR, margin=margin)


def clear_cut(mesh: QuadMesh, rays) -> list[tuple[int, RayHits]]:
    """The rays whose hits do not hang on rounding, with their hits."""
    found = []
    for index in range(len(rays[0])):
        hits = oracle_hits(mesh, rays, index)
        generous, strict = (len(oracle_hits(mesh, rays, index, sign * AMBIGUOUS).t) for sign in (1, -1))
        apart = hits.t.diff().abs().min() if len(hits.t) > 1 else 1.0
        if generous == strict and apart > AMBIGUOUS:
            found.append((index, hits))
    return found


KINDS = {"outside": random_rays, "inside": inside_rays, "along an axis": axis_rays, "in a plane": plane_rays}


@pytest.mark.parametrize("kind", KINDS)
def test_hits_are_those_of_trying_every_triangle_in_order(rng, device, kind):
    mesh = random_mesh(rng, device=device)
    rays = as_float32(KINDS[kind](rng, 150))
    tracer = traced(mesh, rays)
    checked = clear_cut(mesh, rays)
    assert len(checked) >= 0.97 * len(rays[0])
    assert sum(len(hits.t) for _, hits in checked) > 100
    for index, hits in checked:
        quad, t, ab = hits_of(tracer, index)
        assert quad.tolist() == hits.quad.tolist()
        # Rounding of 1e-7 grows by 1 / cosine, at most by 100 here.
        torch.testing.assert_close(t.double(), hits.t, atol=5e-5, rtol=0)
        torch.testing.assert_close(ab.double(), hits.ab, atol=5e-4, rtol=0)


def test_hits_agree_at_grazing_angles(rng, device):
    mesh = sheet_mesh(rng, spread=0.1, device=device)
    target = rng.uniform(-0.7, 0.7, (150, 3)) * [1, 1, 0] + [0, 0, mesh.vertices.cpu().mean(0)[2]]
    directions = unit(rng.normal(size=(150, 3)) * [1, 1, 0.02])
    rays = as_float32((target - 3 * directions, directions))
    tracer = traced(mesh, rays)
    checked = clear_cut(mesh, rays)
    assert len(checked) > 100
    for index, hits in checked:
        quad, _, ab = hits_of(tracer, index)
        assert quad.tolist() == hits.quad.tolist()
        torch.testing.assert_close(ab.double(), hits.ab, atol=5e-3, rtol=0)  # cosines of 0.01: 100 times the rounding


def test_a_ray_meets_a_folded_quad_twice(device):
    quad = np.array([[-0.2, -0.2, 0.0], [-0.2, 0.2, 0.2], [0.2, -0.2, 0.2], [0.2, 0.2, 0.0]]) + 0.25
    mesh = single_quad(quad, device)
    # Along the fold's cross-section, below the ridge: in through one triangle, out through the other.
    direction = unit([1.0, -1.0, 0.0])
    rays = as_float32((np.array([0.25, 0.25, 0.3]) - 2 * direction[None], direction[None]))
    assert len(oracle_hits(mesh, rays, 0).t) == 2
    quads, t, _ = hits_of(traced(mesh, rays), 0)
    assert quads.tolist() == [0, 0]
    torch.testing.assert_close(t.double(), oracle_hits(mesh, rays, 0).t, atol=1e-5, rtol=0)


def single_quad(corners: np.ndarray, device: str = "cpu") -> QuadMesh:
    """One quad in the four cells around (0.25, 0.25, 0.25), its corners [4, 3] put anywhere; cells are 0.5 wide."""
    kept = np.array([(i * 4 + j) * 4 + 2 for i in (2, 3) for j in (2, 3)])
    vertices = torch.from_numpy(np.asarray(corners, np.float32)).to(device)
    return QuadMesh(4, kept, vertices, np.array([[0, 1, 2, 3]], np.int32))


@pytest.mark.parametrize("aim", ["vertex", "edge across a", "edge across b", "diagonal"])
def test_no_ray_slips_through_a_seam(rng, device, aim):
    mesh = sheet_mesh(rng, cells=32, device=device)
    vertices = mesh.vertices.cpu().numpy().astype(float)
    quads = mesh.quads[(np.abs(vertices[mesh.quads][..., :2]) < 0.5).all((1, 2))]
    corners = vertices[quads[rng.integers(0, len(quads), 20_000)]]
    other = {"vertex": 0, "edge across a": 2, "edge across b": 1, "diagonal": 3}[aim]
    share = rng.random((len(corners), 1))
    target = (1 - share) * corners[:, 0] + share * corners[:, other]
    # Steep enough to be on the sheet's other side before they leave the cube.
    outwards = rng.normal(size=target.shape) * [0.7, 0.7, 0.0] + [0, 0, 1]
    origins = target + unit(outwards) * 3.0 * rng.choice([-1, 1], (len(target), 1))
    rays = as_float32((origins, unit(target - origins)))
    assert int(traced(mesh, rays, capacity=16).count.min()) >= 1


def test_a_ray_from_one_side_of_a_sheet_to_the_other_crosses_it_an_odd_number_of_times(rng, device):
    mesh = sheet_mesh(rng, cells=32, device=device)
    target = rng.uniform(-0.6, 0.6, (20_000, 3)) * [1, 1, 0]
    origins = target + unit(rng.normal(size=target.shape) * [0.7, 0.7, 0.0] + [0, 0, 1]) * 3.0
    count = traced(mesh, as_float32((origins, unit(target - origins)))).count
    # A ray that meets a seam to within rounding counts both sides of it.
    assert (count % 2 == 0).float().mean() < 1e-3


def test_straight_through_shared_vertices_and_edges_along_the_axis(device):
    mesh = sheet_mesh(np.random.default_rng(1), spread=0.0, device=device)
    ticks = np.linspace(-0.5, 0.5, 33)
    x, y = np.meshgrid(ticks, ticks)
    origins = np.stack([x.ravel(), y.ravel(), np.full(x.size, 3.0)], -1)
    rays = as_float32((origins, np.tile([0.0, 0.0, -1.0], (len(origins), 1))))
    assert int(traced(mesh, rays, capacity=16).count.min()) >= 1


@pytest.mark.parametrize(
    "corners",
    [
        [[0.25, 0.25, 0.25]] * 4,
        [[0.0, 0.0, 0.2], [0.25, 0.25, 0.2], [0.25, 0.25, 0.2], [0.5, 0.5, 0.2]],
        [[0.0, 0.0, 0.2], [0.5, 0.5, 0.2], [0.0, 0.0, 0.2], [0.5, 0.5, 0.2]],
    ],
)
def test_quads_without_area_give_finite_hits_only(rng, device, corners):
    mesh = single_quad(np.array(corners), device)
    origins, _ = random_rays(rng, 200)
    target = np.array(corners)[rng.integers(0, 4, 200)]
    axis = as_float32((np.array([[0.25, 0.25, 3.0], [0.0, 0.0, 3.0]]), np.array([[0.0, 0, -1], [0, 0, -1]])))
    rays = joined(as_float32((origins, unit(target - origins))), axis)
    tracer = traced(mesh, rays)
    # Rounding gives some of them a sliver of area; then the hit is where the quad is.
    for index in range(len(rays[0])):
        _, t, ab = hits_of(tracer, index)
        assert bool(((ab >= 0) & (ab <= 1)).all())
        points = rays[0][index] + t.numpy()[:, None] * rays[1][index]
        apart = np.linalg.norm(points[:, None] - np.array(corners), axis=-1).min(-1)
        assert (apart < 0.4).all()


def test_a_quad_with_one_triangle_collapsed_is_hit_on_the_other(rng, device):
    corners = np.array([[0.0, 0.0, 0.2], [0.25, 0.25, 0.2], [0.5, 0.0, 0.3], [0.5, 0.5, 0.2]])
    mesh = single_quad(corners, device)
    origins, _ = random_rays(rng, 100)
    target = rng.dirichlet([2, 2, 2], 100) @ corners[[0, 2, 3]]
    rays = as_float32((origins, unit(target - origins)))
    tracer = traced(mesh, rays)
    assert (tracer.count == 1).all()
    for index, hits in clear_cut(mesh, rays):
        torch.testing.assert_close(hits_of(tracer, index)[2].double(), hits.ab, atol=5e-4, rtol=0)


def test_a_ray_within_a_quads_plane_does_not_hit_it(device):
    flat = np.array([[0.0, 0.0, 0.25], [0.0, 0.5, 0.25], [0.5, 0.0, 0.25], [0.5, 0.5, 0.25]])
    rays = as_float32((np.array([[-3.0, 0.2, 0.25], [0.2, 3.0, 0.25]]), np.array([[1.0, 0, 0], [0, -1.0, 0]])))
    assert not traced(single_quad(flat, device), rays).count.any()


@pytest.mark.parametrize("capacity", [1, 2, 3])
def test_hits_beyond_the_capacity_are_the_farthest_ones(rng, device, capacity):
    mesh = random_mesh(rng, device=device)
    rays = as_float32(joined(random_rays(rng, 200), inside_rays(rng, 100)))
    everything, some = traced(mesh, rays), traced(mesh, rays, capacity=capacity)
    assert int(everything.count.max()) > capacity
    assert int(some.count.max()) == capacity
    for index in range(len(rays[0])):
        expected = [a[:capacity].tolist() for a in hits_of(everything, index)[:2]]
        assert [a.tolist() for a in hits_of(some, index)[:2]] == expected


def test_rays_that_miss_the_cube_hit_nothing(rng, device):
    mesh = random_mesh(rng, device=device)
    origins, directions = random_rays(rng, 50)
    rays = as_float32(joined((origins, -directions), (np.array([[-3.0, 1.1, 0.0]]), np.array([[1.0, 0.0, 0.0]]))))
    assert not traced(mesh, rays).count.any()


def opacities(mesh: QuadMesh, alpha: np.ndarray) -> Texels:
    """Quads each of one opacity."""
    shape = (len(mesh.quads), 2, 2)
    texels = np.broadcast_to(alpha[:, None, None], shape)
    return texels_of(texels, np.zeros((*shape, 8)), str(mesh.vertices.device))


@pytest.mark.parametrize("binary_only", [True, False])
def test_a_ray_ends_when_its_light_is_used_up(rng, device, binary_only):
    mesh = random_mesh(rng, device=device)
    rays = as_float32(random_rays(rng, 300))
    alpha = rng.choice([0.0, 0.2, 0.6, 0.9, 0.999, 1.0], len(mesh.quads)).astype(np.float32)
    everything, lit = traced(mesh, rays), traced(mesh, rays, opacities(mesh, alpha), binary_only=binary_only)
    ended = 0
    for index in range(len(rays[0])):
        quads = hits_of(everything, index)[0].numpy()
        opaque = np.cumsum(alpha[quads] > 0.5) >= 2
        dark = np.cumprod(1 - alpha[quads]) < float(OPAQUE)
        over = opaque if binary_only else opaque & dark
        expected = quads[: int(np.argmax(over)) + 1] if over.any() else quads
        ended += len(expected) < len(quads)
        assert hits_of(lit, index)[0].tolist() == expected.tolist()
    assert ended > 30


def test_transmittance_is_what_the_hits_in_front_let_through(rng, device):
    mesh = random_mesh(rng, device=device)
    alpha = rng.uniform(0, 0.4, len(mesh.quads)).astype(np.float32)
    tracer = traced(mesh, as_float32(random_rays(rng, 100)), opacities(mesh, alpha))
    for index in range(100):
        n = int(tracer.count[index])
        a = alpha[tracer.quad[index, :n].cpu().numpy()]
        expected = np.concatenate([[1.0], np.cumprod(1 - a)])[:n]
        np.testing.assert_allclose(tracer.alpha[index, :n].cpu(), a)
        np.testing.assert_allclose(tracer.transmittance[index, :n].cpu(), expected, rtol=1e-5)  # float32 products


def test_hits_follow_vertices_that_move(rng, device):
    mesh = random_mesh(rng, device=device)
    rays = as_float32(random_rays(rng, 60))
    tracer = Tracer(mesh, TEXEL_KERNELS, 60, 1, 64)
    mesh.vertices.copy_(torch.from_numpy(mesh.centres()))
    tracer.vertices_moved()
    tracer.forward(batch_of(*rays, device), clear_texels(mesh, device), binary_only=False)
    fresh = traced(with_vertices(mesh, mesh.centres()), rays)
    assert int(fresh.count.sum()) > 50
    for index in range(60):
        assert hits_of(tracer, index)[0].tolist() == hits_of(fresh, index)[0].tolist()
