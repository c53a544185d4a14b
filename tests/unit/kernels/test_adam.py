"""The optimiser kernels against Adam in float64."""

import numpy as np
import pytest
import torch
import warp as wp

from core.field.frame import as_vec3
from core.field.parameters import Parameters
from core.field.space import Space
from core.kernels.adam import BETA1, TEXEL_BETA2, adam_texels, adam_vertices, bias_correction
from core.kernels.launch import accumulator_parts, launch
from core.oracles.adam import LazyAdam
from core.training.marcher import step_grid

N = 60
BETA2 = 0.997  # of grids and vertices
LOWEST_CHANNEL0 = 1 / 255
# A step is m / sqrt(v) times the rate: 1e-6 relative in float32, and gradients near 0 lose a digit more.
TOLERANCE = 2e-5


def betas(beta2: float = BETA2) -> dict[str, float]:
    return {"beta1": float(BETA1), "beta2": float(beta2)}


def random_parameters(rng: np.random.Generator, device: str) -> Parameters:
    scalar, features = rng.random(N, np.float32), rng.uniform(LOWEST_CHANNEL0, 1, (N, 8)).astype(np.float32)
    return Parameters.starting_from(torch.from_numpy(scalar).to(device), torch.from_numpy(features).to(device))


def add_gradients(rng: np.random.Generator, parameters: Parameters, index: np.ndarray, scale=1.0):
    """Puts random gradients, split over the parts, at some entries; returns their sums."""
    sums = []
    for accumulator in parameters.gradients:
        shares = rng.normal(size=(accumulator.shape[0], len(index), *accumulator.shape[2:])).astype(np.float32) * scale
        accumulator[:, torch.from_numpy(index)] = torch.from_numpy(np.float32(shares)).to(accumulator.device)
        sums.append(np.float32(shares).sum(0, dtype=np.float64))
    return sums


def oracles_of(parameters: Parameters, beta2: float = BETA2) -> tuple[LazyAdam, LazyAdam]:
    return tuple(LazyAdam(t.cpu().numpy(), **betas(beta2)) for t in (parameters.scalar, parameters.features))


def assert_same(parameters: Parameters, scalar: LazyAdam, features: LazyAdam) -> None:
    np.testing.assert_allclose(parameters.scalar.cpu(), scalar.value, atol=TOLERANCE, rtol=0)
    np.testing.assert_allclose(parameters.features.cpu(), features.value, atol=TOLERANCE, rtol=0)


def step_features(oracle: LazyAdam, index, grad, rate, steps=None) -> None:
    oracle.step(index, grad, rate, low=0.0, high=1.0, steps=steps)
    oracle.value[index, 0] = np.maximum(oracle.value[index, 0], LOWEST_CHANNEL0)


def test_the_oracle_is_torch_adam_where_every_entry_is_stepped(rng):
    start = rng.random(20)
    value = torch.from_numpy(start).requires_grad_()
    torch_adam = torch.optim.Adam([value], lr=0.03, betas=tuple(betas().values()), eps=1e-12)
    oracle = LazyAdam(start, **betas())
    for _ in range(10):
        grad = rng.normal(size=20)
        value.grad = torch.from_numpy(grad)
        torch_adam.step()
        oracle.step(np.arange(20), grad, 0.03, low=-np.inf, high=np.inf)
    np.testing.assert_allclose(oracle.value, value.detach(), rtol=1e-9)


def test_grid_steps_agree_on_touched_rows_and_leave_the_other_entries(rng, device):
    everything = random_parameters(rng, device)
    scalar, features = oracles_of(everything)
    trained = np.sort(rng.choice(N, 45, replace=False)).astype(np.int32)
    parameters = everything.training(torch.from_numpy(trained).to(device))
    touched = torch.zeros(len(trained), dtype=torch.uint8, device=device)
    for steps in range(1, 8):
        rows = np.sort(rng.choice(len(trained), 20, replace=False))
        scalar_grad, feature_grad = add_gradients(rng, parameters, rows)
        touched[torch.from_numpy(rows)] = 1
        step_grid(parameters, touched, (0.05, 0.04), 0.2, (-0.25, 0.9), BETA2, steps, device)
        index = trained[rows].astype(int)
        scalar.step(index, scalar_grad, 0.05, low=-0.25, high=0.9, decay=0.2, steps=steps)
        step_features(features, index, feature_grad, 0.04, steps)
        assert_same(parameters, scalar, features)
        assert not touched.any()
        assert not any(g.any() for g in parameters.gradients)


@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_values_stay_within_their_ranges(rng, device, sign):
    parameters = random_parameters(rng, device)
    for steps in range(1, 6):
        for accumulator in parameters.gradients:
            accumulator.fill_(sign * 1e6)
        touched = torch.ones(N, dtype=torch.uint8, device=device)
        step_grid(parameters, touched, (0.9, 0.9), 0.0, (-0.25, 30.0), BETA2, steps, device)
    assert float(parameters.features.min()) >= 0.0
    assert float(parameters.features.max()) <= 1.0
    assert float(parameters.features[:, 0].min()) >= np.float32(LOWEST_CHANNEL0)
    assert float(parameters.scalar.min()) >= -0.25
    assert float(parameters.scalar.max()) <= 30.0


class TexelSteps:
    """Batches of texel steps, each texel listed by the parts that are named."""

    def __init__(self, parameters: Parameters, device: str) -> None:
        self.parameters, self.device, self.parts = parameters, device, parameters.parts
        self.stamp = torch.full((self.parts, N), -1, dtype=torch.int32, device=device)
        self.updates = torch.zeros(N, dtype=torch.int32, device=device)

    def step(self, batch: int, lists: list[np.ndarray], rates: tuple[float, float]) -> None:
        touched = torch.full((self.parts, N), -1, dtype=torch.int32, device=self.device)
        for part, index in enumerate(lists):
            touched[part, : len(index)] = torch.from_numpy(index.astype(np.int32)).to(self.device)
            self.stamp[part, torch.from_numpy(index)] = batch
        state = [self.parameters.scalar_state(), self.parameters.feature_state(), wp.from_torch(self.updates)]
        for part, index in enumerate(lists):
            inputs = [wp.from_torch(touched), wp.from_torch(self.stamp), batch, part, *state, *rates]
            launch(adam_texels, len(index), inputs, self.device)


def test_texels_that_several_parts_list_are_stepped_exactly_once(rng, device):
    parameters = random_parameters(rng, device)
    scalar, features = oracles_of(parameters, TEXEL_BETA2)
    stepper = TexelSteps(parameters, device)
    for batch in range(8):
        lists = [rng.choice(N, 25, replace=False) for _ in range(parameters.parts)]
        index = np.unique(np.concatenate(lists))
        scalar_grad, feature_grad = add_gradients(rng, parameters, index)
        stepper.step(batch, lists, (0.05, 0.04))
        scalar.step(index, scalar_grad, 0.05, low=0.0, high=1.0)
        step_features(features, index, feature_grad, 0.04)
        assert_same(parameters, scalar, features)
        np.testing.assert_array_equal(stepper.updates.cpu(), scalar.counts)
        assert not any(g.any() for g in parameters.gradients)


def test_a_texel_first_met_late_takes_a_full_first_step(rng, device):
    parameters = random_parameters(rng, device)
    parameters.features.fill_(0.5)
    stepper = TexelSteps(parameters, device)
    for batch in range(5):
        index = np.array([7]) if batch == 4 else np.array([1])
        add_gradients(rng, parameters, index)
        stepper.step(batch, [index], (0.05, 0.04))
    # Adam's first step has the length of the rate, whatever the gradient.
    torch.testing.assert_close((parameters.features[7] - 0.5).abs().cpu(), torch.full((8,), 0.04), atol=1e-6, rtol=0)


def test_frozen_opacity_stays(rng, device):
    parameters = random_parameters(rng, device)
    before = parameters.scalar.clone()
    add_gradients(rng, parameters, np.arange(5))
    TexelSteps(parameters, device).step(0, [np.arange(5)], (0.0, 0.04))
    assert torch.equal(parameters.scalar, before)
    assert not parameters.gradients[1].any()


class VertexSteps:
    """Vertices [N, 3] around their cells' centres, and their steps."""

    REACH = 0.01

    def __init__(self, rng: np.random.Generator, device: str) -> None:
        self.device, parts = device, accumulator_parts(device)
        self.centres = torch.from_numpy(rng.uniform(-0.9, 0.9, (N, 3)).astype(np.float32)).to(device)
        self.value, self.grad = self.centres.clone(), torch.zeros(parts, N, 3, device=device)
        self.moments = torch.zeros(N, 3, device=device), torch.zeros(N, 3, device=device)
        self.steps = 0

    def step(self, rate: float, pull: float = 0.0) -> None:
        self.steps += 1
        arrays = [as_vec3(t) for t in (self.value, self.grad, *self.moments, self.centres)]
        space = Space.cube().kernel_space()
        launch(
            adam_vertices,
            N,
            [space, *arrays, self.REACH, rate, pull, BETA2, bias_correction(self.steps, BETA2)],
            self.device,
        )


def test_vertex_steps_agree_and_leave_vertices_without_gradient(rng, device):
    vertices = VertexSteps(rng, device)
    oracle = LazyAdam(np.zeros((N, 3)), **betas())
    for _ in range(6):
        index = np.sort(rng.choice(N, 20, replace=False))
        grad = rng.normal(size=(len(vertices.grad), 20, 3)).astype(np.float32)
        vertices.grad[:, torch.from_numpy(index)] = torch.from_numpy(grad).to(device)
        vertices.step(2e-3, pull=0.1)
        oracle.step(index, grad.sum(0, dtype=float), 2e-3, low=-0.01, high=0.01, steps=vertices.steps)
        oracle.value[index] *= 0.9
        moved = (vertices.value - vertices.centres).cpu()
        np.testing.assert_allclose(moved, oracle.value, atol=2e-7, rtol=0)  # float32 steps of positions up to 1
        assert not vertices.grad.any()


@pytest.mark.parametrize("size", [1e-20, 1.0, 1e18, 1e30])
def test_vertices_stay_within_reach_whatever_the_gradient(rng, device, size):
    vertices = VertexSteps(rng, device)
    for _ in range(20):
        vertices.grad.copy_(torch.from_numpy(rng.normal(size=vertices.grad.shape) * size))
        vertices.step(rate=1.0)
    apart = (vertices.value - vertices.centres).abs()
    assert bool(torch.isfinite(vertices.value).all())
    assert float(apart.max()) <= vertices.REACH + 1.2e-7  # one rounding of a position up to 1


def test_pull_brings_vertices_back_to_the_centres_of_their_cells(rng, device):
    vertices = VertexSteps(rng, device)
    vertices.value += vertices.REACH
    for _ in range(200):
        vertices.grad.fill_(1e-10)
        vertices.step(rate=0.0, pull=0.05)
    torch.testing.assert_close(vertices.value, vertices.centres, atol=1e-6, rtol=0)
