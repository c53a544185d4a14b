"""The pull towards neighbours against the derivative of its loss in float64."""

import numpy as np
import pytest
import torch
import warp as wp

from core.field.parameters import Parameters
from core.kernels.launch import launch
from core.kernels.smoothness import smoothness_gradient
from core.kernels.types import vec8
from core.oracles.smoothness import smoothness_loss

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
    features = torch.from_numpy(rng.random((N**3, 8), np.float32)).to(device)
    trained = torch.from_numpy(np.flatnonzero(rng.random(N**3) < share).astype(np.int32)).to(device)
    return Parameters.starting_from(torch.zeros(N**3, device=device), features, trained)


@pytest.mark.parametrize("share", [1.0, 0.6, 0.1])
def test_touched_rows_get_the_derivative_of_the_loss(rng, device, share):
    parameters = some_parameters(rng, share, device)
    touched = torch.from_numpy((rng.random(len(parameters.trained)) < 0.5).astype(np.uint8)).to(device)
    grid = parameters.features.double().cpu().reshape(N, N, N, 8).requires_grad_()
    (WEIGHT * smoothness_loss(grid, (parameters.row_of >= 0).cpu().reshape(N, N, N))).backward()
    expected = grid.grad.reshape(-1, 8)[parameters.trained.long().cpu()].numpy() * touched.cpu().numpy()[:, None]
    # Sums of six differences of numbers up to 1, in float32.
    np.testing.assert_allclose(pulled(parameters, touched, device), expected, atol=1e-6)


def test_even_features_are_not_pulled(rng, device):
    parameters = some_parameters(rng, 0.7, device)
    parameters.features.fill_(0.37)
    touched = torch.ones(len(parameters.trained), dtype=torch.uint8, device=device)
    assert not pulled(parameters, touched, device).any()


def test_opposite_faces_of_the_grid_are_no_neighbours(rng, device):
    parameters = some_parameters(rng, 1.0, device)
    parameters.features.zero_()
    parameters.features.reshape(N, N, N, 8)[:, :, -1] = 1.0
    touched = torch.ones(N**3, dtype=torch.uint8, device=device)
    pull = pulled(parameters, touched, device).reshape(N, N, N, 8)
    assert not pull[:, :, 0].any()
    np.testing.assert_allclose(pull[:, :, -1], WEIGHT, rtol=1e-6)
