"""The volume on the mesh: gradients of opacity, features and vertices, against float64 autograd."""

import numpy as np
import torch
import warp as wp

from core.field.bricks import from_bricks, places_in
from core.kernels.launch import accumulator_parts
from core.kernels.surfaces import GRAZING, VOLUME_KERNELS, Volume, VolumeGradients
from core.kernels.types import vec8
from core.mesh.quad_mesh import QuadMesh
from core.oracles import composite as oracle
from core.oracles.grid import trilinear
from core.oracles.moving_hits import distances
from core.training.tracer import Tracer
from core.training.volume import sampled
from tests.unit.kernels.meshes import random_mesh
from tests.unit.kernels.rays import as_float32, batch_of, inside_rays, joined, random_rays

NODES = 9
SUBRAYS = 2


def random_volume(rng: np.random.Generator, device: str) -> tuple[Volume, torch.Tensor, torch.Tensor]:
    """(volume as kernels read it, float64 opacity [n, n, n, 1] and features [n, n, n, 8] that want gradients)."""
    alpha = rng.uniform(0.0, 1.0, (places_in(NODES),)).astype(np.float32)
    features = rng.random((places_in(NODES), 8), np.float32)
    volume = Volume()
    volume.nodes = NODES
    volume.alpha = wp.array(alpha, dtype=float, device=device)
    volume.features = wp.array(features, dtype=vec8, device=device)
    exact = [from_bricks(torch.from_numpy(a).double(), NODES) for a in (alpha[:, None], features)]
    return volume, exact[0].requires_grad_(), exact[1].requires_grad_()


def kernel_gradients(tracer: Tracer, batch, volume: Volume, grads) -> list[torch.Tensor]:
    """[opacity [n], features [n, 8], vertices [V, 3], touched [n]] of the tracer's last forward pass."""
    device, n = tracer.device, places_in(NODES)
    parts, V = accumulator_parts(device), tracer.kernel_mesh.vertices.shape[0]
    alpha, features = torch.zeros(parts, n, device=device), torch.zeros(parts, n, 8, device=device)
    vertices, touched = torch.zeros(parts, V, 3, device=device), torch.zeros(n, dtype=torch.uint8, device=device)
    gradients = VolumeGradients()
    gradients.row_of = wp.array(np.arange(n, dtype=np.int32), device=device)
    gradients.alpha, gradients.features = wp.from_torch(alpha), wp.from_torch(features, dtype=vec8)
    gradients.touched, gradients.vertices = wp.from_torch(touched), wp.from_torch(vertices, dtype=wp.vec3)
    given = [tuple(torch.from_numpy(np.float32(g)).to(device) for g in pair) for pair in grads]
    tracer.backward(batch, volume, *given, gradients, parts)
    return [*(g.sum(0).cpu().double() for g in (alpha, features, vertices)), touched.cpu()]


def exact_loss(tracer: Tracer, mesh: QuadMesh, rays, vertices, alpha, features, grads) -> torch.Tensor:
    """The loss that `grads` stand for, hits recomputed from the vertices."""
    losses = []
    for ray in range(len(rays[0])):
        n = int(tracer.count[ray])
        if n == 0:
            continue
        quads = torch.from_numpy(mesh.quads).long()[tracer.quad[ray, :n].cpu().long()]
        ab = tracer._ab[ray, :n].cpu()
        middle = torch.where(ab[:, 1] >= ab[:, 0], quads[:, 1], quads[:, 2])
        corners = vertices[torch.stack([quads[:, 0], middle, quads[:, 3]], 1)]
        origin, direction = (torch.from_numpy(a[ray]).double().expand(n, 3) for a in rays)
        points = origin + distances(corners, origin, direction, float(GRAZING))[:, None] * direction
        hit_alpha, hit_features = trilinear(alpha, points)[:, 0], trilinear(features, points)
        for model, (gF, gA) in zip((oracle.continuous, oracle.binary), grads, strict=True):
            F, A = model(hit_alpha, hit_features)
            pixel = ray // SUBRAYS
            losses.append(((torch.from_numpy(gF[pixel]) * F).sum() + gA[pixel] * A) / SUBRAYS)
    return torch.stack(losses).sum()


def test_gradients_agree_with_autograd(rng, device):
    mesh, (volume, alpha, features) = random_mesh(rng, device=device), random_volume(rng, device)
    rays = as_float32(joined(random_rays(rng, 100), inside_rays(rng, 40)))
    pixels = len(rays[0]) // SUBRAYS
    tracer, batch = Tracer(mesh, VOLUME_KERNELS, pixels, SUBRAYS, 64), batch_of(*rays, device)
    tracer.forward(batch, volume, binary_only=False)
    grads = [(rng.normal(size=(pixels, 8)), rng.normal(size=pixels)) for _ in range(2)]
    *actual, touched = kernel_gradients(tracer, batch, volume, grads)
    vertices = mesh.vertices.cpu().double().requires_grad_()
    loss = exact_loss(tracer, mesh, rays, vertices, alpha, features, grads)
    expected = torch.autograd.grad(loss, (alpha, features, vertices))
    # Relative to the largest gradient; vertices' gradients grow by 1 / cosine, up to 10 times, with their rounding.
    for found, wanted, tolerance in zip(actual, expected, (1e-4, 1e-4, 5e-4), strict=True):
        scale = float(wanted.abs().max())
        assert scale > 0.1
        of_nodes = found if found.shape == wanted.shape else from_bricks(found, NODES).reshape(wanted.shape)
        torch.testing.assert_close(of_nodes, wanted, atol=tolerance * scale, rtol=0)
    reached = (expected[0] != 0).any(-1) | (expected[1] != 0).any(-1)
    assert bool(from_bricks(touched, NODES)[reached].all())


def test_sampling_is_trilinear_up_to_the_faces_of_the_cube(rng, device):
    volume, alpha, features = random_volume(rng, device)
    corners = np.stack(np.meshgrid([-1, 1], [-1, 1], [-1, 1]), -1).reshape(-1, 3)
    points = np.concatenate([rng.uniform(-1, 1, (200, 3)), corners]).astype(np.float32)
    found = sampled(volume, torch.from_numpy(points).to(device), device)
    exact = torch.from_numpy(points).double()
    # Points are kept 1e-3 of a node's spacing inside of the last node: 1e-3 times differences of up to 1.
    torch.testing.assert_close(found[0].cpu().double(), trilinear(alpha, exact)[:, 0].detach(), atol=3e-3, rtol=0)
    torch.testing.assert_close(found[1].cpu().double(), trilinear(features, exact).detach(), atol=3e-3, rtol=0)
