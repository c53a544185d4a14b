"""Marching through a voxel field, and its gradients, against float64 autograd."""

import numpy as np
import pytest
import torch

from core.field.bricks import from_bricks, to_bricks
from core.field.parameters import Parameters
from core.field.space import Space
from core.field.voxels import DENSITY_SCALE, EMPTY_DENSITY, VoxelField
from core.kernels import march as kernel
from core.oracles import march as oracle
from core.training import marcher as marching
from core.training.marcher import Marcher
from core.training.survey import Survey
from tests.unit.kernels.rays import as_float32, axis_rays, inside_rays, joined, plane_rays, random_rays

# float32 adds up distances and products of order 1 over 60 samples: 60 x 6e-8, times the field's slope of about 10.
TOLERANCE = 1e-4
NODES = 14


def field_of(density: np.ndarray, features: np.ndarray, occupied: np.ndarray, device: str = "cpu") -> VoxelField:
    """A field from density [n, n, n], features [n, n, n, 8] and occupied [c, c, c]."""
    n = len(density)
    scalar, colours = (torch.from_numpy(a.astype(np.float32)).to(device) for a in (density, features))
    parameters = Parameters.starting_from(to_bricks(scalar), to_bricks(colours))
    return VoxelField(Space.cube(), n, parameters, torch.from_numpy(occupied).to(device))


def mixed_field(rng: np.random.Generator, device: str = "cpu", *, nodes: int = NODES) -> VoxelField:
    """Raw densities below the leak, between it and 0, a little above 0, and far above; smooth in between."""
    density = rng.choice([-0.25, -0.1, -0.02, 0.0, 0.02, 0.1, 0.3], (nodes,) * 3) + rng.normal(0, 0.01, (nodes,) * 3)
    density[rng.random(density.shape) < 0.02] = 30.0
    return field_of(density, rng.random((*density.shape, 8)), np.ones((5, 5, 5), bool), device)


def awkward_rays(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    along_edge = np.array([[-3.0, 0.9998, -0.9998], [0.9998, 0.9998, 3.0]]), np.array([[1.0, 0, 0], [0, 0, -1.0]])
    missing = np.array([[-3.0, 1.1, 0.0], [2.0, 2.0, 2.0], [0.0, 0.0, 3.0]]), np.eye(3)
    diagonal = np.array([[-2.0, -2.0, -2.0]]), np.ones((1, 3)) / np.sqrt(3)
    ordinary = joined(random_rays(rng, 24), inside_rays(rng, 12), axis_rays(rng, 12), plane_rays(rng, 12))
    return as_float32(joined(along_edge, missing, diagonal, ordinary))


def marched(field: VoxelField, rays, jitter: np.ndarray):
    """(marcher, F, A) of rays in the order given."""
    marcher = Marcher(field, str(field.parameters.scalar.device))
    F, A = marcher.forward(*on_device(field, *rays, jitter))
    return marcher, F.cpu().double(), A.cpu().double()


def on_device(field: VoxelField, *arrays: np.ndarray) -> list[torch.Tensor]:
    device = field.parameters.scalar.device
    return [torch.from_numpy(np.ascontiguousarray(a, np.float32)).to(device) for a in arrays]


def how_of(field: VoxelField) -> oracle.March:
    return oracle.March(field.step, DENSITY_SCALE, float(kernel.LEAK), float(kernel.OPAQUE))


def exact_grids(field: VoxelField) -> tuple[torch.Tensor, torch.Tensor]:
    n = field.nodes
    density = from_bricks(field.parameters.scalar.detach().cpu().double(), n)
    features = from_bricks(field.parameters.features.detach().cpu().double(), n)
    return density.requires_grad_(), features.requires_grad_()


def exact_rays(field: VoxelField, rays, jitter: np.ndarray):
    """(density, features, rendered rays) of the oracle."""
    density, features = exact_grids(field)
    o, d = (torch.from_numpy(a).double() for a in rays)
    return density, features, [
        oracle.render(how_of(field), density, features, *ray, float(j)) for *ray, j in zip(o, d, jitter, strict=True)
    ]  # fmt: skip


def test_forward_agrees_with_the_oracle(rng, device):
    field, rays = mixed_field(rng, device), awkward_rays(rng)
    jitter = rng.random(len(rays[0]), np.float32)
    _, F, A = marched(field, rays, jitter)
    _, _, expected = exact_rays(field, rays, jitter)
    torch.testing.assert_close(F, torch.stack([ray.F for ray in expected]).detach(), atol=TOLERANCE, rtol=0)
    torch.testing.assert_close(A, torch.stack([ray.A for ray in expected]).detach(), atol=TOLERANCE, rtol=0)


@pytest.mark.parametrize("weight", [0.0, 0.5])
def test_gradients_agree_with_autograd(rng, device, weight):
    field, rays = mixed_field(rng, device), awkward_rays(rng)
    jitter = rng.random(len(rays[0]), np.float32)
    gF, gA = rng.normal(size=(len(jitter), 8)), rng.normal(size=len(jitter))
    marcher, *_ = marched(field, rays, jitter)
    marcher.backward(*on_device(field, *rays, gF, gA), weight)
    density, features, expected = exact_rays(field, rays, jitter)
    losses = [
        (torch.from_numpy(gF[i]) * ray.F).sum() + gA[i] * ray.A + weight * oracle.distortion(ray.w, ray.t, field.step)
        for i, ray in enumerate(expected)
    ]
    torch.stack(losses).sum().backward()
    grad_density, grad_features = (g.sum(0).cpu().double() for g in field.parameters.gradients)
    # Relative to the largest gradient: a node sums a few dozen samples' float32 products, scaled by 64 x 0.1 = 7.
    for actual, wanted in ((grad_density, density.grad), (grad_features, features.grad)):
        scale = float(wanted.abs().max())
        # Samples that weigh less than 1e-4 leave the features alone: up to 1e-4 of the gradient each.
        torch.testing.assert_close(from_bricks(actual, field.nodes), wanted, atol=5e-4 * scale, rtol=0)


def test_rays_that_miss_the_cube_see_nothing_and_touch_nothing(rng, device):
    field = mixed_field(rng, device)
    rays = as_float32((np.array([[-3.0, 1.1, 0.0], [0.0, 0.0, 3.0]]), np.array([[1.0, 0, 0], [0, 0, 1.0]])))
    marcher, F, A = marched(field, rays, np.zeros(2))
    marcher.backward(*on_device(field, *rays, np.ones((2, 8)), np.ones(2)), 1.0)
    assert not F.any()
    assert not A.any()
    assert not any(g.any() for g in field.parameters.gradients)


def uniform_alpha(density: float, device: str) -> tuple[torch.Tensor, torch.Tensor]:
    """(opacity of one ray along x through a uniform field, gradients of the density)."""
    field = field_of(np.full((6, 6, 6), density), np.full((6, 6, 6, 8), 0.5), np.ones((4, 4, 4), bool), device)
    rays = as_float32((np.array([[-3.0, 0.1, 0.2]]), np.array([[1.0, 0, 0]])))
    marcher, _, A = marched(field, rays, np.array([0.5]))
    marcher.backward(*on_device(field, *rays, np.zeros((1, 8)), np.ones(1)), 0.0)
    return A, field.parameters.gradients[0].sum(0).cpu()


@pytest.mark.parametrize("density", [-0.1, 0.0])
def test_density_just_below_zero_is_transparent_but_learns(device, density):
    A, gradient = uniform_alpha(density, device)
    assert not A.any()
    assert gradient.max() > 0


@pytest.mark.parametrize("density", [-0.2, -0.12])
def test_density_at_or_below_the_leak_does_not_learn(device, density):
    A, gradient = uniform_alpha(density, device)
    assert not A.any()
    assert not gradient.any()


def test_saturated_opacity_is_one_and_stays_finite(device):
    A, gradient = uniform_alpha(30.0, device)
    assert A == 1.0
    assert torch.isfinite(gradient).all()


def test_skipping_empty_cells_changes_nothing(rng, device):
    nodes, cells = 33, 8  # four node spacings a cell
    density = rng.normal(0.05, 0.1, (nodes,) * 3)
    solid = rng.random((cells,) * 3) < 0.03
    reached = np.zeros((nodes,) * 3, bool)  # nodes of solid cells; all others are empty
    for i, j, k in np.argwhere(solid) * 4:
        reached[i : i + 5, j : j + 5, k : k + 5] = True
    density[~reached] = EMPTY_DENSITY
    # A cell that any non-empty node borders on is occupied: where trilinear interpolation exceeds the leak.
    occupied = np.zeros_like(solid)
    for i, j, k in np.argwhere(reached):
        low, high = (np.clip(np.array([i, j, k]) + d, 0, nodes - 2) // 4 for d in (-1, 0))
        occupied[low[0] : high[0] + 1, low[1] : high[1] + 1, low[2] : high[2] + 1] = True
    assert 0.2 < occupied.mean() < 0.9
    features, rays = rng.random((nodes, nodes, nodes, 8)), awkward_rays(rng)
    jitter = rng.random(len(rays[0]), np.float32)
    results = []
    for cells_occupied in (occupied, np.ones_like(occupied)):
        field = field_of(density, features, cells_occupied, device)
        marcher, F, A = marched(field, rays, jitter)
        marcher.backward(*on_device(field, *rays, np.ones((len(jitter), 8)), np.ones(len(jitter))), 0.1)
        results.append([F, A, *(g.sum(0).cpu().double() for g in field.parameters.gradients)])
    # Distances are added up in other portions: 1e-6 apart, times slopes of up to 64 x 10.
    for skipping, walking in zip(*results, strict=True):
        torch.testing.assert_close(skipping, walking, atol=5e-4 * max(1.0, float(walking.abs().max())), rtol=0)


def test_a_ray_with_more_samples_than_room_is_marched_again(rng, device, monkeypatch):
    field, rays = mixed_field(rng, device), awkward_rays(rng)
    jitter = rng.random(len(rays[0]), np.float32)
    _, F, A = marched(field, rays, jitter)
    monkeypatch.setattr(marching, "FIRST_CAPACITY", 2)
    cramped, F_cramped, A_cramped = marched(field, rays, jitter)
    assert torch.equal(F_cramped, F)
    assert torch.equal(A_cramped, A)
    assert int(cramped._count.max()) > 2


def test_no_ray_takes_more_samples_than_the_field_allows(device):
    field = field_of(np.full((9, 9, 9), 1e-6), np.zeros((9, 9, 9, 8)), np.ones((4, 4, 4), bool), device)
    corner = as_float32((np.full((1, 3), -2.0), np.ones((1, 3)) / np.sqrt(3)))
    marcher, _, _ = marched(field, corner, np.zeros(1))
    assert int(marcher._count.max()) <= field.max_samples()


def test_survey_adds_up_what_rays_see_in_each_cell(rng, device):
    field, rays, cells = mixed_field(rng, device), awkward_rays(rng), 6
    jitter = np.full(len(rays[0]), 0.5, np.float32)
    marcher, *_ = marched(field, rays, jitter)
    n, survey = cells**3, Survey.empty(cells, -1, device)
    marcher.survey(*on_device(field, *rays), survey)
    _, _, expected = exact_rays(field, rays, jitter)
    peak, mass, moment = torch.zeros(n), torch.zeros(n), torch.zeros(n, 3)
    for ray, o, d in zip(expected, *(torch.from_numpy(a) for a in rays), strict=True):
        for w, t in zip(ray.w.tolist(), ray.t.tolist(), strict=True):
            if w > 1e-3:
                p = o + t * d
                i, j, k = ((p + 1) * cells / 2).long().tolist()
                cell = (i * cells + j) * cells + k
                peak[cell], mass[cell] = max(float(peak[cell]), w), mass[cell] + w
                moment[cell] += w * p
    # A sample within rounding of a cell's face or of the threshold may count elsewhere: at most a few of thousands.
    found = survey.peak.amax(0), survey.mass.sum(0), survey.moment.sum(0)
    for actual, wanted in zip(found, (peak, mass, moment), strict=True):
        assert ((actual.cpu() - wanted).abs() > 1e-3).float().mean() < 0.02
