"""The paper's own setting: its parts against slow oracles, and the whole at toy size."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
import torch

from benchmarks.reference_setting import PaperRun, PaperSetting, bake_paper, networks
from benchmarks.reference_setting.acceleration import AccelerationGrid
from benchmarks.reference_setting.grid_mesh import QUADS_AROUND, GridMesh
from benchmarks.reference_setting.networks import PaperNetworks, encoded
from benchmarks.reference_setting.quadrature import cells_along, intersections
from benchmarks.reference_setting.rendering import Points, visibility
from benchmarks.reference_setting.setting import STAGE1_UNTIL, STAGE2_UNTIL
from benchmarks.reference_setting.training import Moment
from core.errors import TrainingFailed
from core.evaluation import evaluate
from exporters.gltf import read_glb, write_glb
from tests.unit.training.captures import ball, capture_of

P = 4
TOY = PaperSetting(cells=8, patch=4, width=32, depth=3, frequencies=4, batch=512)


@pytest.fixture
def mesh(rng) -> GridMesh:
    mesh = GridMesh(P)
    with torch.no_grad():
        mesh.offsets.copy_(torch.from_numpy(rng.uniform(-0.45, 0.45, (P**3, 3))))
    return mesh


def rays(rng, count: int) -> tuple[torch.Tensor, torch.Tensor]:
    """From outside and, every fourth, from inside of the cube."""
    origins = rng.normal(size=(count, 3))
    origins *= np.where(np.arange(count) % 4, 3.0, 0.5)[:, None] / np.linalg.norm(origins, axis=1, keepdims=True)
    directions = rng.uniform(-0.8, 0.8, (count, 3)) - origins
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    return torch.from_numpy(origins).float(), torch.from_numpy(directions).float()


def hits_by_trying_everything(mesh: GridMesh, o: np.ndarray, d: np.ndarray) -> list[float]:
    """Distances of a ray's hits on every triangle of the mesh, by Moeller and Trumbore, in float64."""
    quads = mesh.quads(torch.ones(mesh.cells**3, dtype=torch.bool))
    corners = mesh.vertex(quads).detach().double().numpy()
    found = []
    for quad in corners:
        for a, b, c in (quad[[0, 1, 3]], quad[[0, 2, 3]]):
            e1, e2, away = b - a, c - a, o - a
            determinant = e1 @ np.cross(d, e2)
            u = away @ np.cross(d, e2) / determinant
            v = d @ np.cross(away, e1) / determinant
            t = e2 @ np.cross(away, e1) / determinant
            if u >= 0 and v >= 0 and u + v <= 1 and t > 0:
                found.append(t)
    return sorted(found)


def test_quadrature_points_are_the_hits_of_trying_every_triangle(mesh, rng):
    origins, directions = rays(rng, 60)
    hits = intersections(mesh, origins, directions, keep=1000)
    for ray in range(len(origins)):
        expected = hits_by_trying_everything(mesh, origins[ray].double().numpy(), directions[ray].double().numpy())
        found = hits.t[hits.ray == ray].numpy()
        # Rays are float32; none of these comes so near to an edge that it decides.
        np.testing.assert_allclose(found, expected, atol=1e-4)


def test_points_lie_on_their_rays_and_in_order(mesh, rng):
    origins, directions = rays(rng, 40)
    hits = intersections(mesh, origins, directions, keep=1000)
    points = hits.points(mesh)
    on_ray = origins[hits.ray] + hits.t[:, None] * directions[hits.ray]
    assert float((points - on_ray).detach().abs().max()) < 1e-4
    for ray in range(len(origins)):
        assert hits.rank[hits.ray == ray].tolist() == list(range(int((hits.ray == ray).sum())))
        assert all(a <= b for a, b in pairwise(hits.t[hits.ray == ray].tolist()))


def test_the_nearest_points_are_kept(mesh, rng):
    origins, directions = rays(rng, 40)
    everything, few = (intersections(mesh, origins, directions, keep) for keep in (1000, 2))
    assert int(few.rank.max()) == 1
    np.testing.assert_array_equal(few.t, everything.t[everything.rank < 2])


def test_pruned_cells_have_no_points(mesh, rng):
    origins, directions = rays(rng, 40)
    nothing = torch.zeros(P**3, dtype=torch.bool)
    assert len(intersections(mesh, origins, directions, 1000, nothing).t) == 0
    everything = intersections(mesh, origins, directions, 1000)
    same = intersections(mesh, origins, directions, 1000, ~nothing)
    np.testing.assert_array_equal(same.t, everything.t)


def test_a_ray_meets_a_regular_grid_at_most_3p_times(rng):
    origins, directions = rays(rng, 200)
    hits = intersections(GridMesh(P), origins, directions, keep=1000)
    assert int(hits.rank.max()) + 1 <= 3 * P


def test_rays_parallel_to_planes_and_from_within_have_finite_cells():
    origins = torch.tensor([[-3.0, 0.1, 0.2], [0.1, 0.1, 0.1], [-1.0, 0.25, 0.0]])
    directions = torch.tensor([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]])
    ray, cell, enter, leave = cells_along(origins, directions, P)
    assert torch.isfinite(enter).all()
    assert torch.isfinite(leave).all()
    assert (ray == 0).sum() == P
    assert (ray == 1).sum() == 3  # two cells below the one it starts in
    assert ((cell >= 0) & (cell < P)).all()


def test_a_cells_vertex_is_used_by_twelve_quads_that_all_include_it():
    assert QUADS_AROUND.shape == (12, 4, 3)
    assert all((quad == 0).all(1).any() for quad in QUADS_AROUND)
    assert len({tuple(map(tuple, quad)) for quad in QUADS_AROUND.tolist()}) == 12


def test_a_grid_has_a_quad_for_each_inner_edge_and_none_at_pruned_cells():
    mesh = GridMesh(P)
    everything = mesh.quads(torch.ones(P**3, dtype=torch.bool))
    assert len(everything) == 3 * P * (P - 1) ** 2
    wanted = torch.ones(P**3, dtype=torch.bool)
    wanted[0] = False
    assert len(mesh.quads(wanted)) == len(everything) - 3


def test_gradients_reach_vertices_by_barycentric_weights(mesh, rng):
    origins, directions = rays(rng, 5)
    hits = intersections(mesh, origins, directions, 1000)
    hits.points(mesh).sum().backward()
    expected = np.zeros((P**3, 3))
    np.add.at(expected, hits.vertices.numpy().ravel(), hits.weights.numpy().ravel()[:, None] * 2.0 / P)
    np.testing.assert_allclose(mesh.offsets.grad, expected, atol=1e-6)


def test_visibility_is_what_is_left_times_opacity(rng):
    alpha = torch.from_numpy(rng.uniform(size=(3, 5)))
    weight = visibility(alpha).numpy()
    for ray, opacities in enumerate(alpha.numpy()):
        left = 1.0
        for k, opacity in enumerate(opacities):
            assert weight[ray, k] == pytest.approx(left * opacity)
            left *= 1.0 - opacity


def test_binary_opacity_is_0_or_1_and_passes_gradients_straight_through():
    alpha = torch.tensor([[0.2, 0.5, 0.6]], requires_grad=True)
    binary = Points(alpha, torch.zeros(1, 3, 8), None).binary_alpha
    assert binary.tolist() == [[0.0, 0.0, 1.0]]
    (binary * torch.tensor([[1.0, 2.0, 3.0]])).sum().backward()
    assert alpha.grad.tolist() == [[1.0, 2.0, 3.0]]


def test_the_acceleration_grid_rises_only_where_something_is_seen():
    grid = AccelerationGrid(P)
    positions = torch.full((1, 3), -0.9, requires_grad=True)
    weight = torch.tensor([0.8], requires_grad=True)
    grid.loss(positions, weight).backward()
    assert grid.bound.grad[0, 0, 0] == -1.0  # no sparsity at 0, and a smooth grid
    assert not grid.bound.grad.reshape(-1)[1:].any()
    assert positions.grad is None
    assert weight.grad is None


def test_the_networks_have_the_papers_sizes():
    made = PaperNetworks(PaperSetting(), seed=0)
    shapes = [tuple(layer.weight.shape) for layer in made.A.layers]
    assert shapes == [(384, 63), *[(384, 384)] * 4, (384, 447), (384, 384), (384, 384)]
    assert made.F.head.weight.shape == (8, 384)
    assert [layer.weight.shape for layer in made.H if isinstance(layer, torch.nn.Linear)] == [
        (16, 11), (16, 16), (3, 16),
    ]  # fmt: skip
    assert encoded(torch.zeros(2, 3), 10).shape == (2, 63)


def test_the_schedule_goes_through_the_papers_stages():
    assert Moment(0, 0.0).stage == 1
    assert [Moment(0, STAGE1_UNTIL * part).points_divisor for part in (0.2, 0.3, 0.6)] == [1, 2, 4]
    assert Moment(0, STAGE1_UNTIL).stage == 2
    assert not Moment(0, STAGE2_UNTIL - 0.01).fine_tuning
    assert Moment(0, STAGE2_UNTIL).fine_tuning
    assert Moment(0, 0.1).rate > Moment(0, 0.9).rate > Moment(0, 1.0).rate > 0


@pytest.fixture(scope="module")
def capture():
    return capture_of(ball(), views=12)


def test_stage_1_learns_a_ball(capture, monkeypatch, device):
    monkeypatch.setattr(networks, "OPACITY_BIAS", -4.0)  # rises to something in 60 steps
    run, steps = PaperRun(capture, TOY, device=device), 60
    for step in range(steps):
        run.step(Moment(step, STAGE1_UNTIL * step / steps))
    # The background alone is at 11.6 dB.
    assert run.held_out_psnr(Moment(0, 0.0), 1024) > 13.0


def test_the_baked_scene_shows_what_the_networks_say(capture, monkeypatch, device):
    monkeypatch.setattr(networks, "OPACITY_BIAS", 0.0)
    run = PaperRun(capture, replace(TOY, patch=17), device=device)
    everywhere = (torch.rand(512, 3, generator=torch.Generator().manual_seed(0)) * 2.0 - 1.0).to(device)
    with torch.no_grad():  # untrained, but opaque here and there
        run.networks.A.head.weight.mul_(100.0)
        run.networks.A.head.bias.sub_(run.networks.A(everywhere).mean())
    scene = read_glb(write_glb(bake_paper(run))["scene.glb"])
    in_stage_2 = run.held_out_psnr(Moment(0, STAGE2_UNTIL), 2048)
    # All pixels against random ones, and texels of a 17th of a quad against none.
    assert evaluate(scene, capture.test).psnr == pytest.approx(in_stage_2, abs=0.5)


@pytest.mark.slow
def test_all_stages_learn_a_ball(capture):
    run, steps = PaperRun(capture, replace(TOY, width=48), device="cpu"), 600
    for step in range(steps):
        run.step(Moment(step, step / steps))
    assert evaluate(bake_paper(run), capture.test).psnr > 15.0


def test_pruning_by_a_grid_that_has_learnt_nothing_empties_the_scene(capture):
    run, steps = PaperRun(capture, replace(TOY, prune=True), device="cpu"), 20
    for step in range(steps):
        run.step(Moment(step, step / steps))
    with pytest.raises(TrainingFailed, match="opaque"):
        bake_paper(run)


def test_training_stops_when_its_time_is_up_and_measuring_does_not_count(capture):
    run, seen = PaperRun(capture, TOY, device="cpu"), []
    run.train(0.3, lambda run, moment: seen.append(moment.share))
    assert run.seconds >= 0.3
    assert seen == sorted(seen)
    assert len(seen) == run.steps
