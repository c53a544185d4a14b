"""Tracing through tapered cells and through shells, against trying every triangle."""

import numpy as np
import pytest
import torch

from core.field.space import Space
from core.mesh.quad_mesh import FACES, shells_around
from tests.unit.kernels.meshes import mesh_of
from tests.unit.kernels.rays import as_float32, inside_rays, joined, unit
from tests.unit.kernels.test_trace import clear_cut, hits_of, traced

TAPERS = {"deep": Space.taper((0.9, 0.6), 25.0), "shallow": Space.taper((0.9, 0.6), 1.5)}


def camera_rays(rng: np.random.Generator, count: int, space: Space) -> tuple[np.ndarray, np.ndarray]:
    """Rays from around the origin to points of the tapered grid."""
    origins = rng.uniform(-0.3, 0.3, (count, 3))
    return origins, unit(space.to_scene(rng.uniform(-0.95, 0.95, (count, 3))) - origins)


def stray_rays(rng: np.random.Generator, count: int, space: Space) -> tuple[np.ndarray, np.ndarray]:
    """Rays from within the grid in all directions, sideways and back, too; some exactly across or along the axis."""
    origins = space.to_scene(rng.uniform(-0.9, 0.9, (count, 3)))
    directions = unit(rng.normal(size=(count, 3)))
    directions[::4] = np.eye(3)[rng.integers(0, 3, len(directions[::4]))]
    return origins, directions


@pytest.mark.parametrize("space", TAPERS.values(), ids=TAPERS)
@pytest.mark.parametrize("rays_of", [camera_rays, stray_rays])
def test_hits_in_tapered_cells_are_those_of_trying_every_triangle(rng, device, space, rays_of):
    mesh = mesh_of(rng, 7, rng.random((7, 7, 7)) < 0.8, device=device, space=space)
    rays = as_float32(rays_of(rng, 400, space))
    tracer = traced(mesh, rays)
    checked = clear_cut(mesh, rays)
    assert len(checked) > 0.9 * len(rays[0])
    assert sum(len(hits.t) for _, hits in checked) > 100
    for index, hits in checked:
        quad, t, ab = hits_of(tracer, index)
        assert quad.tolist() == hits.quad.tolist()
        # Distances of up to 25, in float32, at cosines of 0.01 and more.
        torch.testing.assert_close(t.double(), hits.t, atol=1e-3, rtol=1e-4)
        torch.testing.assert_close(ab.double(), hits.ab, atol=2e-3, rtol=0)


def test_hits_on_shells_are_those_of_trying_every_triangle(rng, device):
    space, cells = Space.shells(), 6
    seen = rng.random((shells_around(space, cells) + 1, FACES, cells, cells)) < 0.6
    mesh = mesh_of(rng, cells, rng.random((cells,) * 3) < 0.7, device=device, space=space, shells=seen)
    assert (mesh.shell_cells >= 0).sum() == seen.sum()
    parallel = np.tile(np.eye(3), (20, 1)) * rng.choice([-1.0, 1.0], (60, 1))
    rays = as_float32(joined(inside_rays(rng, 200), (rng.uniform(-0.8, 0.8, (60, 3)), parallel)))
    tracer = traced(mesh, rays)
    checked = clear_cut(mesh, rays)
    assert len(checked) > 0.9 * len(rays[0])
    for index, hits in checked:
        quad, t, ab = hits_of(tracer, index)
        assert quad.tolist() == hits.quad.tolist()
        torch.testing.assert_close(t.double(), hits.t, atol=1e-3, rtol=1e-4)
        torch.testing.assert_close(ab.double(), hits.ab, atol=2e-3, rtol=0)


def test_pruned_shells_are_not_hit(rng, device):
    space, cells = Space.shells(), 6
    seen = np.ones((shells_around(space, cells) + 1, FACES, cells, cells), bool)
    mesh = mesh_of(rng, cells, np.zeros((cells,) * 3, bool), device=device, space=space, shells=seen)
    keep = rng.random(len(mesh.quads)) < 0.5
    some = mesh.with_quads(keep)
    rays = as_float32(inside_rays(rng, 100))
    names = np.cumsum(keep) - 1
    everything, rest = traced(mesh, rays), traced(some, rays)
    for index in range(100):
        before = [names[quad] for quad in hits_of(everything, index)[0].tolist() if keep[quad]]
        assert hits_of(rest, index)[0].tolist() == before
