"""What the stages hand to one another."""

from itertools import pairwise

import numpy as np
import pytest
import torch

from core.kernels.surfaces import TEXEL_KERNELS
from core.presets import PRESETS, settings_for
from core.training.texel_stage import _texel_points
from core.training.tracer import Tracer
from core.training.voxel_stage import levels_of
from tests.unit.kernels.meshes import random_mesh, texels_of
from tests.unit.kernels.rays import as_float32, batch_of, random_rays

SMALLEST = settings_for("draft", nodes=16, voxel_steps=1, voxel_batch=64)


@pytest.mark.parametrize("settings", [*PRESETS.values(), SMALLEST], ids=[*PRESETS, "smallest"])
def test_levels_rise_to_the_settings_and_end_with_the_stage(settings):
    levels = levels_of(settings)
    assert levels[-1].nodes == settings.nodes
    assert levels[-1].end == settings.voxel_steps
    for before, after in pairwise(levels):
        assert before.nodes <= after.nodes
        assert before.end <= after.end
    assert all(level.nodes >= 16 and level.batch >= 64 for level in levels)


@pytest.mark.parametrize("K", [2, 4])
def test_a_baked_texel_is_looked_up_where_it_was_baked(rng, device, K):
    mesh = random_mesh(rng, device=device)
    points = torch.cat(_texel_points(mesh, K)).cpu().numpy().reshape(len(mesh.quads), K, K, 3)
    features = np.concatenate([points, np.zeros((*points.shape[:3], 5))], -1)
    rays = as_float32(random_rays(rng, 300))
    tracer = Tracer(mesh, TEXEL_KERNELS, 300, 1, 64)
    opaque = texels_of(np.ones(points.shape[:3]), features, device)
    _, (F, A) = tracer.forward(batch_of(*rays, device), opaque, binary_only=True)
    hit = A.cpu().numpy() > 0
    assert hit.sum() > 100
    place = rays[0] + tracer.t[:, :1].cpu().numpy() * rays[1]
    # A texel's centre is within half a texel, along a and along b, of every place that shows it.
    corners = mesh.vertices.cpu().numpy()[mesh.quads[tracer.quad[:, 0].cpu().numpy()[hit]]]
    edges = np.linalg.norm(corners[:, [1, 3, 2, 0]] - corners[:, [0, 1, 3, 2]], axis=-1).max(1)
    apart = np.linalg.norm(F.cpu().numpy()[hit, :3] - place[hit], axis=1)
    assert (apart <= edges / (K - 1) + 1e-5).all()


def test_texel_points_reach_from_corner_to_corner(rng):
    mesh, K = random_mesh(rng), 3
    points = torch.cat(_texel_points(mesh, K)).reshape(-1, K, K, 3)
    corners = mesh.vertices[torch.from_numpy(mesh.quads).long()]
    torch.testing.assert_close(points[:, [0, 0, -1, -1], [0, -1, 0, -1]], corners, atol=1e-6, rtol=0)  # float32
