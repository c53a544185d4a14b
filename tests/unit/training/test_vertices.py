"""Vertices as they train."""

import numpy as np
import pytest
import torch

from core.field.space import Space
from core.mesh.quad_mesh import VERTEX_REACH, shells_around
from core.training.vertices import MovingVertices
from tests.unit.kernels.meshes import build_mesh, sheet_mesh

P = 8


def add_gradient(vertices: MovingVertices, gradient: torch.Tensor) -> None:
    vertices._grad[0, : len(gradient)] += gradient.to(vertices._grad.device)


def test_a_vertex_goes_against_its_gradient_by_the_rate_in_cells(rng, device):
    mesh = sheet_mesh(rng, P, spread=0.1, device=device)
    before, vertices = mesh.vertices.clone(), MovingVertices(mesh, 0.99)
    gradient = torch.zeros(len(before), 3)
    gradient[5] = torch.tensor([3.0, -0.001, 0.0])
    add_gradient(vertices, gradient)
    vertices.step(0.01, 0.0, 1)
    moved = (mesh.vertices - before).cpu()
    # Adam's first step has the rate's length along every axis with a gradient.
    expected = torch.tensor([-0.01, 0.01, 0.0]) * mesh.cell_size
    torch.testing.assert_close(moved[5], expected, atol=1e-6, rtol=1e-3)
    moved[5] = 0.0
    assert float(moved.abs().max()) == 0.0
    assert float(vertices._grad.abs().max()) == 0.0


def test_vertices_stay_within_their_cells(rng, device):
    mesh = sheet_mesh(rng, P, device=device)
    vertices = MovingVertices(mesh, 0.99)
    for step in range(1, 200):
        add_gradient(vertices, torch.ones(len(mesh.vertices), 3))
        vertices.step(0.05, 0.0, step)
    away = np.abs(mesh.vertices.cpu().numpy() - mesh.centres()).max()
    assert away == pytest.approx(VERTEX_REACH * mesh.cell_size, rel=1e-5)


def test_shells_alone_have_nothing_to_move(device):
    space = Space.shells()
    shells = np.zeros((shells_around(space, P) + 1, 6, P, P), bool)
    shells[2] = True
    mesh = build_mesh(np.zeros((P,) * 3, bool), np.full((P, P, P, 3), np.nan), device, space, shells)
    before, vertices = mesh.vertices.clone(), MovingVertices(mesh, 0.99)
    add_gradient(vertices, torch.ones(len(before), 3))
    vertices.step(0.05, 0.0, 1)
    assert torch.equal(mesh.vertices, before)


def test_moments_are_restored(rng, device):
    mesh = sheet_mesh(rng, P, device=device)
    vertices = MovingVertices(mesh, 0.99)
    add_gradient(vertices, torch.ones(len(mesh.vertices), 3))
    vertices.step(0.01, 0.0, 1)
    other = MovingVertices(mesh, 0.99)
    other.restore([moment.cpu() for moment in vertices.moments])
    for mine, saved in zip(other.moments, vertices.moments, strict=True):
        assert torch.equal(mine, saved)
