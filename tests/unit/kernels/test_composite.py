"""Compositing texels, and its gradient, against cumulative products and float64 autograd."""

from dataclasses import dataclass

import numpy as np
import pytest
import torch
import warp as wp

from core.kernels.launch import accumulator_parts
from core.kernels.surfaces import TEXEL_KERNELS, TexelGradients
from core.kernels.types import vec8
from core.mesh.quad_mesh import QuadMesh
from core.oracles import composite as oracle
from core.training.tracer import Tracer
from tests.unit.kernels.meshes import random_mesh, texels_of
from tests.unit.kernels.rays import as_float32, batch_of, inside_rays, joined, random_rays

K = 3
# Sums of at most 20 float32 products of order 1.
TOLERANCE = 1e-5
# Opacities at their bounds, at the threshold (not opaque), just above it, and in between.
AWKWARD = [0.0, 0.2, 0.5, np.nextafter(np.float32(0.5), 1), 0.8, 1.0]
MODELS = {"continuous": oracle.continuous, "binary": oracle.binary}


@dataclass
class Setup:
    """Rays on a mesh with texels: float64 opacity [Q K K] and features [Q K K, 8], which want gradients."""

    tracer: Tracer
    surface: object
    rays: tuple[np.ndarray, np.ndarray]
    alpha: torch.Tensor
    features: torch.Tensor

    def hits(self, ray: int) -> torch.Tensor:
        """The texels that a ray meets, front to back."""
        n = int(self.tracer.count[ray])
        ij = (self.tracer._ab[ray, :n].cpu() * (K - 1) + 0.5).long()
        return (self.tracer.quad[ray, :n].cpu().long() * K + ij[:, 0]) * K + ij[:, 1]

    def pixel(self, model: str, index: int) -> tuple[torch.Tensor, torch.Tensor]:
        """(features, coverage) of a pixel by the oracle: the mean over its sub-rays."""
        subrays = range(index * self.tracer.subrays, (index + 1) * self.tracer.subrays)
        parts = [MODELS[model](self.alpha[self.hits(ray)], self.features[self.hits(ray)]) for ray in subrays]
        return torch.stack([F for F, _ in parts]).mean(0), torch.stack([A for _, A in parts]).mean(0)


def setup_of(mesh: QuadMesh, rays, alpha: np.ndarray, features: np.ndarray, subrays: int = 1) -> Setup:
    device = str(mesh.vertices.device)
    surface = texels_of(alpha, features, device)
    tracer = Tracer(mesh, TEXEL_KERNELS, len(rays[0]) // subrays, subrays, 64)
    exact = [torch.from_numpy(a.astype(np.float32)).double() for a in (alpha.reshape(-1), features.reshape(-1, 8))]
    return Setup(tracer, surface, rays, *(tensor.requires_grad_() for tensor in exact))


def random_setup(rng: np.random.Generator, device: str, alpha=AWKWARD, subrays: int = 3) -> Setup:
    mesh = random_mesh(rng, device=device)
    rays = as_float32(joined(random_rays(rng, 60), inside_rays(rng, 30)))
    shape = (len(mesh.quads), K, K)
    return setup_of(mesh, rays, rng.choice(alpha, shape), rng.random((*shape, 8)), subrays)


def composited(setup: Setup, *, binary_only: bool = False):
    batch = batch_of(*setup.rays, setup.tracer.device)
    sums = setup.tracer.forward(batch, setup.surface, binary_only=binary_only)
    return dict(zip(MODELS, sums, strict=True))


def gradients_of(setup: Setup, grads: dict[str, tuple], *, with_alpha: bool = True):
    """(opacity [n], features [n, 8], touched [n] bool) after the backward pass of {model: (dL/dF, dL/dA)}."""
    device, n = setup.tracer.device, len(setup.alpha)
    parts = accumulator_parts(device)
    alpha, features = torch.zeros(parts, n, device=device), torch.zeros(parts, n, 8, device=device)
    stamp = torch.full((parts, n), -1, dtype=torch.int32, device=device)
    touched, count = torch.full_like(stamp, -1), torch.zeros(parts, dtype=torch.int32, device=device)
    gradients = TexelGradients()
    gradients.alpha, gradients.features = wp.from_torch(alpha), wp.from_torch(features, dtype=vec8)
    gradients.stamp, gradients.touched = wp.from_torch(stamp), wp.from_torch(touched)
    gradients.touched_count, gradients.batch, gradients.with_alpha = wp.from_torch(count), 5, int(with_alpha)
    given = [tuple(torch.from_numpy(np.float32(g)).to(device) for g in grads[model]) for model in MODELS]
    setup.tracer.backward(batch_of(*setup.rays, device), setup.surface, *given, gradients, parts)
    listed = torch.zeros(n, dtype=torch.int32)
    for part in range(parts):
        some = touched[part, : int(count[part])].cpu().long()
        assert len(some) == len(set(some.tolist())), "a part lists a texel twice"
        assert bool((stamp[part].cpu()[some] == 5).all())
        listed[some] += 1
    return alpha.sum(0).cpu().double(), features.sum(0).cpu().double(), listed > 0


def random_gradients(rng: np.random.Generator, pixels: int, models=tuple(MODELS)):
    """{model: (dL/dF, dL/dA)}: random for some models, zero for the others."""
    return {
        model: (rng.normal(size=(pixels, 8)) * (model in models), rng.normal(size=pixels) * (model in models))
        for model in MODELS
    }


def autograd(setup: Setup, grads) -> tuple[torch.Tensor, torch.Tensor]:
    losses = []
    for model, (gF, gA) in grads.items():
        for index in range(setup.tracer.pixels):
            F, A = setup.pixel(model, index)
            losses.append((torch.from_numpy(gF[index]) * F).sum() + gA[index] * A)
    return torch.autograd.grad(torch.stack(losses).sum(), (setup.alpha, setup.features))


def test_sums_are_means_over_sub_rays(rng, device):
    setup = random_setup(rng, device)
    sums = composited(setup)
    assert int((setup.tracer.count == 0).sum()) > 0
    for model, (F, A) in sums.items():
        for index in range(setup.tracer.pixels):
            F_exact, A_exact = setup.pixel(model, index)
            torch.testing.assert_close(F[index].cpu().double(), F_exact.detach(), atol=TOLERANCE, rtol=0)
            torch.testing.assert_close(A[index].cpu().double(), A_exact.detach(), atol=TOLERANCE, rtol=0)


@pytest.mark.parametrize("models", [("continuous",), ("binary",), ("continuous", "binary")], ids="+".join)
def test_gradients_agree_with_autograd(rng, device, models):
    setup = random_setup(rng, device)
    composited(setup)
    grads = random_gradients(rng, setup.tracer.pixels, models)
    alpha, features, _ = gradients_of(setup, grads)
    alpha_exact, features_exact = autograd(setup, grads)
    # Sums of a few dozen products of order 1.
    torch.testing.assert_close(alpha, alpha_exact, atol=1e-4, rtol=0)
    torch.testing.assert_close(features, features_exact, atol=1e-4, rtol=0)
    assert float(alpha_exact.abs().max()) > 0.1


@pytest.mark.parametrize("opacity", [0.0, 1.0])
def test_gradients_agree_where_every_texel_is_at_its_bound(rng, device, opacity):
    setup = random_setup(rng, device, alpha=[opacity])
    composited(setup)
    grads = random_gradients(rng, setup.tracer.pixels)
    for actual, expected in zip(gradients_of(setup, grads), autograd(setup, grads), strict=False):
        torch.testing.assert_close(actual, expected, atol=1e-4, rtol=0)


def test_binary_gradients_need_no_more_than_the_recorded_hits(rng, device):
    setup = random_setup(rng, device, alpha=[0.3, 0.6])
    composited(setup)
    everything = [setup.hits(ray) for ray in range(len(setup.rays[0]))]
    composited(setup, binary_only=True)
    assert sum(len(setup.hits(ray)) < len(hits) for ray, hits in enumerate(everything)) >= 5
    grads = random_gradients(rng, setup.tracer.pixels, ("binary",))
    alpha, features, _ = gradients_of(setup, grads)
    setup.hits = everything.__getitem__
    alpha_exact, features_exact = autograd(setup, grads)
    torch.testing.assert_close(alpha, alpha_exact, atol=1e-4, rtol=0)
    torch.testing.assert_close(features, features_exact, atol=1e-4, rtol=0)


def test_texels_in_front_of_the_first_opaque_one_learn_from_what_lies_behind(device):
    mesh = random_mesh(np.random.default_rng(2), device=device)
    setup = random_setup(np.random.default_rng(2), device, alpha=[0.2], subrays=1)
    composited(setup)
    assert int(setup.tracer.count.max()) > 1
    nothing = np.zeros((setup.tracer.pixels, 8)), np.zeros(setup.tracer.pixels)
    more_coverage = nothing[0], np.ones(setup.tracer.pixels)
    alpha, _, _ = gradients_of(setup, {"continuous": nothing, "binary": more_coverage})
    hit = torch.cat([setup.hits(ray) for ray in range(setup.tracer.pixels)]).unique()
    assert len(mesh.quads) * K * K > len(hit) > 0
    assert bool((alpha[hit] >= 1.0).all())  # nothing is opaque: every hit would cover its pixel
    assert alpha.count_nonzero() == len(hit)


def test_rays_without_hits_give_nothing_and_touch_nothing(rng, device):
    mesh = random_mesh(rng, device=device)
    origins, directions = random_rays(rng, 8)
    shape = (len(mesh.quads), K, K)
    setup = setup_of(mesh, as_float32((origins, -directions)), np.ones(shape), np.ones((*shape, 8)), 4)
    for F, A in composited(setup).values():
        assert not F.any()
        assert not A.any()
    alpha, features, touched = gradients_of(setup, random_gradients(rng, 2))
    assert not alpha.any()
    assert not features.any()
    assert not touched.any()


def test_the_lists_of_touched_texels_hold_exactly_the_texels_that_were_hit(rng, device):
    setup = random_setup(rng, device)
    composited(setup)
    _, _, touched = gradients_of(setup, random_gradients(rng, setup.tracer.pixels))
    hit = torch.cat([setup.hits(ray) for ray in range(len(setup.rays[0]))]).unique()
    assert touched.nonzero()[:, 0].tolist() == hit.tolist()


def test_frozen_opacity_gets_no_gradient(rng, device):
    setup = random_setup(rng, device)
    composited(setup)
    grads = random_gradients(rng, setup.tracer.pixels)
    alpha, features, _ = gradients_of(setup, grads, with_alpha=False)
    assert not alpha.any()
    torch.testing.assert_close(features, autograd(setup, grads)[1], atol=1e-4, rtol=0)
