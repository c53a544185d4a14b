"""The pull towards neighbours against the derivative of its loss in float64."""

import numpy as np
import pytest
import torch
import warp as wp

from core.field.bricks import from_bricks, places_in, to_bricks
from core.field.parameters import Parameters
from core.kernels.launch import launch
from core.kernels.smoothness import smoothness_gradient, texel_smoothness_gradient
from core.kernels.types import vec8
from core.oracles.smoothness import patch_smoothness_loss, smoothness_loss

N, WEIGHT = 6, 0.3


def pulled(parameters: Parameters, touched: torch.Tensor, device: str, weight: float = WEIGHT) -> np.ndarray:
    """[rows, 8]: what the kernel adds."""
    gradient = parameters.gradients[1]
    inputs = [
        N, weight, wp.from_torch(parameters.trained), wp.from_torch(parameters.row_of), wp.from_torch(touched),
        wp.from_torch(parameters.features, dtype=vec8), wp.from_torch(gradient, dtype=vec8),
    ]  # fmt: skip
    launch(smoothness_gradient, len(parameters.trained), inputs, device)
    return gradient.sum(0).cpu().numpy()


def some_parameters(rng: np.random.Generator, share: float, device: str) -> Parameters:
    features = torch.from_numpy(rng.random((places_in(N), 8), np.float32)).to(device)
    trained = to_bricks(torch.from_numpy(rng.random((N, N, N)) < share)).nonzero()[:, 0].to(torch.int32).to(device)
    return Parameters.starting_from(torch.zeros(places_in(N), device=device), features, trained)


@pytest.mark.parametrize("share", [1.0, 0.6, 0.1])
def test_touched_rows_get_the_derivative_of_the_loss(rng, device, share):
    parameters = some_parameters(rng, share, device)
    touched = torch.from_numpy((rng.random(len(parameters.trained)) < 0.5).astype(np.uint8)).to(device)
    grid = from_bricks(parameters.features.double().cpu(), N).requires_grad_()
    (WEIGHT * smoothness_loss(grid, from_bricks(parameters.row_of >= 0, N).cpu())).backward()
    expected = to_bricks(grid.grad)[parameters.trained.long().cpu()].numpy() * touched.cpu().numpy()[:, None]
    # Sums of six differences of numbers up to 1, in float32.
    np.testing.assert_allclose(pulled(parameters, touched, device), expected, atol=1e-6)


def test_even_features_are_not_pulled(rng, device):
    parameters = some_parameters(rng, 0.7, device)
    parameters.features.fill_(0.37)
    touched = torch.ones(len(parameters.trained), dtype=torch.uint8, device=device)
    assert not pulled(parameters, touched, device).any()


def test_opposite_faces_of_the_grid_are_no_neighbours(rng, device):
    parameters = some_parameters(rng, 1.0, device)
    features = torch.zeros(N, N, N, 8)
    features[:, :, -1] = 1.0
    parameters.features.copy_(to_bricks(features))
    touched = torch.ones(N**3, dtype=torch.uint8, device=device)
    pull = np.zeros((places_in(N), 8), np.float32)
    pull[parameters.trained.cpu()] = pulled(parameters, touched, device)
    pull = from_bricks(torch.from_numpy(pull), N).numpy()
    assert not pull[:, :, 0].any()
    np.testing.assert_allclose(pull[:, :, -1], WEIGHT, rtol=1e-6)


QUADS, K, BATCH = 5, 4, 7


def patches_pulled(features: torch.Tensor, alpha: torch.Tensor, lists: list[np.ndarray], device: str) -> np.ndarray:
    """[texels, 8]: what the kernel adds for texels on each part's list."""
    n = len(alpha)
    touched = torch.zeros(len(lists), n, dtype=torch.int32)
    stamp = torch.full((len(lists), n), -1, dtype=torch.int32)
    for part, listed in enumerate(lists):
        touched[part, : len(listed)] = torch.from_numpy(listed)
        stamp[part, listed] = BATCH
    gradient = torch.zeros(len(lists), n, 8, device=device)
    shared = [wp.from_torch(touched.to(device)), wp.from_torch(stamp.to(device)), BATCH]
    held = [wp.from_torch(alpha), wp.from_torch(features, dtype=vec8), wp.from_torch(gradient, dtype=vec8)]
    for part, listed in enumerate(lists):
        launch(texel_smoothness_gradient, len(listed), [*shared, part, K, WEIGHT, *held], device)
    return gradient.sum(0).cpu().numpy()


def some_texels(rng: np.random.Generator, device: str) -> tuple[torch.Tensor, torch.Tensor]:
    n = QUADS * K * K
    features, alpha = rng.random((n, 8), np.float32), rng.random(n, np.float32)
    alpha[:4] = (0.0, 0.5, np.nextafter(np.float32(0.5), np.float32(1)), 1.0)
    return torch.from_numpy(features).to(device), torch.from_numpy(alpha).to(device)


def test_touched_texels_get_the_derivative_of_the_loss_once(rng, device):
    features, alpha = some_texels(rng, device)
    first, second = (rng.permutation(len(alpha))[:40].astype(np.int32) for _ in range(2))  # some are on both lists
    patches = features.double().cpu().reshape(QUADS, K, K, 8).requires_grad_()
    (WEIGHT * patch_smoothness_loss(patches, (alpha > 0.5).cpu().reshape(QUADS, K, K))).backward()
    expected = patches.grad.reshape(-1, 8).numpy().copy()
    expected[np.setdiff1d(np.arange(len(alpha)), np.union1d(first, second))] = 0.0
    # Sums of four differences of numbers up to 1, in float32.
    np.testing.assert_allclose(patches_pulled(features, alpha, [first, second], device), expected, atol=1e-6)


def test_patches_and_holes_pull_nothing(rng, device):
    everything = np.arange(QUADS * K * K, dtype=np.int32)
    _, alpha = some_texels(rng, device)
    of_patch = torch.arange(QUADS, dtype=torch.float32, device=device).repeat_interleave(K * K)
    even = of_patch[:, None].expand(-1, 8).contiguous()
    assert not patches_pulled(even, torch.ones_like(alpha), [everything], device).any()
    holes_differ = torch.where(alpha[:, None] > 0.5, 0.3, torch.rand(len(alpha), 8).to(device)).contiguous()
    assert not patches_pulled(holes_differ, alpha, [everything], device).any()
