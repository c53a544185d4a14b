"""The loss, and the pixel that it looks at."""

import numpy as np
import pytest
import torch

from core.field.network import MIN_COVERAGE, baked_network, new_network, shade
from core.training.loss import color_error, pixel_loss, psnr_of


def pixels(rng: np.random.Generator, n: int = 50) -> tuple[torch.Tensor, ...]:
    """(colour times coverage, coverage, true colour times alpha, alpha), float64."""
    coverage, alpha = rng.random((2, n))
    color, true = rng.random((2, n, 3)) * np.stack([coverage, alpha])[..., None]
    return tuple(torch.from_numpy(a) for a in (color, coverage, true, alpha))


def over(color: torch.Tensor, coverage: torch.Tensor, background: float) -> torch.Tensor:
    return color + (1.0 - coverage)[:, None] * background


def error_over(pixels_: tuple[torch.Tensor, ...], background: float) -> torch.Tensor:
    color, coverage, true, alpha = pixels_
    return ((over(color, coverage, background) - over(true, alpha, background)) ** 2).mean()


def test_the_loss_is_the_error_over_white_and_black_and_the_weighted_error_of_coverage(rng):
    some = pixels(rng)
    expected = (error_over(some, 1.0) + error_over(some, 0.0)) / 2 + 0.3 * ((some[1] - some[3]) ** 2).mean()
    torch.testing.assert_close(pixel_loss(*some, 0.3), expected)


def test_the_loss_is_zero_exactly_for_the_photo(rng):
    _, _, true, alpha = pixels(rng)
    assert pixel_loss(true, alpha, true, alpha, 0.5) == 0.0


@pytest.mark.parametrize("shade_of_grey", [0.0, 0.5, 1.0])
def test_an_object_as_bright_as_a_background_needs_coverage_all_the_same(shade_of_grey):
    nothing = torch.zeros(4, 3), torch.zeros(4)
    assert pixel_loss(*nothing, torch.full((4, 3), shade_of_grey), torch.ones(4), 0.0) > 0.1


def test_reported_error_is_the_error_over_white(rng):
    some = pixels(rng)
    assert color_error(*some) == pytest.approx(float(error_over(some, 1.0)))


@pytest.mark.parametrize(("errors", "psnr"), [([0.01, 0.01], 20.0), ([0.0], 100.0), ([0.0, 2.0], 0.0), ([], 0.0)])
def test_psnr_of_errors(errors, psnr):
    assert psnr_of(errors) == pytest.approx(psnr)


@pytest.mark.parametrize("coverage", [0.0, 1e-30, 1e-7, MIN_COVERAGE, 0.5, 1.0])
def test_shading_stays_finite_with_finite_gradients_at_any_coverage(rng, coverage):
    network = new_network(0)
    A = torch.full((20,), coverage, requires_grad=True)
    F = (torch.from_numpy(rng.random((20, 8), np.float32)) * coverage).requires_grad_()
    directions = torch.nn.functional.normalize(torch.from_numpy(rng.normal(size=(20, 3)).astype(np.float32)), dim=1)
    color = shade(network, F, A, directions)
    pixel_loss(color, A, torch.zeros(20, 3), torch.ones(20), 0.1).backward()
    for tensor in (color, F.grad, A.grad, *(p.grad for p in network.parameters())):
        assert bool(torch.isfinite(tensor).all())
    assert bool((color <= coverage).all())
    # Features count by the share of the pixel that they cover: no gradient grows as coverage falls.
    assert float(F.grad.abs().max()) < 10.0
    assert float(A.grad.abs().max()) < 10.0


def test_a_pixel_without_coverage_is_black():
    color = shade(new_network(0), torch.zeros(3, 8), torch.zeros(3), torch.eye(3))
    assert not color.any()


def test_shading_depends_on_the_mean_feature_not_on_coverage(rng):
    network, f = new_network(1), torch.from_numpy(rng.random((10, 8), np.float32))
    directions = torch.eye(3)[torch.arange(10) % 3]
    whole = shade(network, f, torch.ones(10), directions)
    quarter = shade(network, 0.25 * f, torch.full((10,), 0.25), directions)
    torch.testing.assert_close(quarter, 0.25 * whole)


def test_a_saturated_network_keeps_colours_in_range_and_gradients_finite(rng):
    network = new_network(2)
    with torch.no_grad():
        for parameter in network.parameters():
            parameter *= 1e6
    f = torch.from_numpy(rng.random((30, 8), np.float32)).requires_grad_()
    color = shade(network, f, torch.ones(30), torch.eye(3)[torch.arange(30) % 3])
    color.sum().backward()
    assert bool(((color >= 0) & (color <= 1)).all())
    assert bool(torch.isfinite(f.grad).all())


def test_the_baked_network_computes_what_was_trained(rng):
    network = new_network(3)
    f, d = rng.random((50, 8)), rng.normal(size=(50, 3))
    d /= np.linalg.norm(d, axis=1, keepdims=True)
    expected = shade(network, torch.from_numpy(f).float(), torch.ones(50), torch.from_numpy(d).float())
    np.testing.assert_allclose(baked_network(network)(f, d), expected.detach(), atol=2e-6)  # float32 against float64


def test_a_new_network_depends_on_its_seed_alone():
    state = torch.random.get_rng_state()
    one, same, other = new_network(1), new_network(1), new_network(2)
    assert torch.equal(one[0].weight, same[0].weight)
    assert not torch.equal(one[0].weight, other[0].weight)
    assert torch.equal(torch.random.get_rng_state(), state)
