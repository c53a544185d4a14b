"""The three parameterisations, against the paper's formulas, each other's inverses, and the kernels."""

import numpy as np
import pytest
import warp as wp
from hypothesis import given
from hypothesis import strategies as st

from core.field.space import Space
from core.kernels import space as kernel
from core.kernels.launch import launch
from core.kernels.space import Space as KernelSpace

SPACES = {
    "cube": Space.cube(),
    "taper": Space.taper((0.7, 0.5), 30.0),
    "shallow taper": Space.taper((0.2, 1.5), 1.5),
    "shells": Space.shells(),
    "near shells": Space.shells(3.0),
}
spaces = pytest.mark.parametrize("space", SPACES.values(), ids=SPACES)


def grid_points(rng: np.random.Generator, n: int) -> np.ndarray:
    """Points of [-1, 1]^3, with corners, faces and the middle among them."""
    special = np.array([[x, y, z] for x in (-1, 0, 1) for y in (-1, 0, 1) for z in (-1, 0, 1)], float)
    return np.concatenate([special, rng.uniform(-1, 1, (n, 3))])


@spaces
def test_grid_and_scene_are_inverse_to_one_another(rng, space):
    g = grid_points(rng, 500)
    np.testing.assert_allclose(space.to_grid(space.to_scene(g)), g, atol=1e-12)


def test_the_taper_is_the_papers():
    p = np.array([[0.5, -0.5, -0.5], [0.25, 0.5, 0.5], [0.0, 0.1, 0.0]])  # normalised coordinates in [-0.5, 0.5]
    w, u = np.log(25.0), 1.75
    z = np.exp(w * (p[:, 2] + 0.5))
    expected = np.stack([u * p[:, 0] * z, u * p[:, 1] * z, z], -1)
    np.testing.assert_allclose(Space.taper().to_scene(2 * p), expected, rtol=1e-12)


def test_the_shells_are_the_papers():
    space, L = Space.shells(), 64
    w = space.growth
    d = (np.exp(w * np.arange(L + 1) / L) + w - 1) / (2 * w)  # eq. 24, for a unit cube
    np.testing.assert_allclose(space.shell_halves(L), 2 * d, rtol=1e-12)
    assert d[0] == 0.5
    assert d[-1] == pytest.approx(8.0)


def test_shells_are_even_in_the_grid(rng):
    space = Space.shells()
    halves = space.shell_halves(48)
    radii = np.abs(space.to_grid(np.array([[h, 0.3 * h, -0.9 * h] for h in halves]))).max(1)
    np.testing.assert_allclose(np.diff(radii), 0.5 / 48, atol=1e-12)


@given(reach=st.floats(1.01, 1e4))
def test_any_reach_has_a_growth(reach):
    assert Space.shells(1.0 + reach).shell_halves(10)[-1] == pytest.approx(1.0 + reach, rel=1e-9)
    assert Space.taper((1.0, 1.0), reach).to_scene(np.array([0.0, 0.0, 1.0]))[2] == pytest.approx(reach, rel=1e-9)


@wp.kernel
def evaluate(
    first: int,
    space: KernelSpace,
    p: wp.array(dtype=wp.vec3),
    d: wp.array(dtype=wp.vec3),
    g: wp.array(dtype=wp.vec3),
    velocity: wp.array(dtype=wp.vec3),
    back: wp.array(dtype=wp.vec3),
    span: wp.array(dtype=wp.vec2),
):
    i = first + wp.tid()
    g[i] = kernel.to_grid(space, p[i])
    velocity[i] = kernel.grid_velocity(space, p[i], d[i])
    back[i] = kernel.from_cells(space, kernel.to_cells(space, p[i]))
    near, far = kernel.grid_span(space, p[i], d[i], 1.0)
    span[i] = wp.vec2(near, far)


def evaluated(space: Space, p: np.ndarray, d: np.ndarray, device: str):
    inputs = [wp.array(a.astype(np.float32), dtype=wp.vec3, device=device) for a in (p, d)]
    outputs = [wp.zeros(len(p), dtype=t, device=device) for t in (wp.vec3, wp.vec3, wp.vec3, wp.vec2)]
    launch(evaluate, len(p), [space.kernel_space(), *inputs, *outputs], device)
    return [o.numpy().astype(float) for o in outputs]


def directions(rng: np.random.Generator, n: int) -> np.ndarray:
    d = rng.normal(size=(n, 3))
    return d / np.linalg.norm(d, axis=1, keepdims=True)


@spaces
def test_kernels_agree(rng, device, space):
    p = space.to_scene(rng.uniform(-0.99, 0.99, (500, 3)))
    d = directions(rng, 500)
    g, velocity, back, _ = evaluated(space, p, d, device)
    np.testing.assert_allclose(g, space.to_grid(p), atol=2e-6)  # float32, coordinates of order 1
    np.testing.assert_allclose(back, p, rtol=2e-5, atol=1e-6)  # exp of up to 4.6 costs four of its roundings
    h = 1e-6
    difference = (space.to_grid(p + h * d) - space.to_grid(p - h * d)) / (2 * h)
    edges = np.sort(np.abs(p), 1)[:, 1:] @ [-1, 1] < 1e-4  # the largest axis changes: the way has a kink
    rim = np.abs(np.abs(p).max(1) - 1) < 1e-4
    smooth = ~(edges | rim)
    np.testing.assert_allclose(velocity[smooth], difference[smooth], rtol=1e-4, atol=1e-5)


@spaces
def test_a_rays_span_is_its_part_within_the_grid(rng, device, space):
    target = space.to_scene(rng.uniform(-1, 1, (300, 3)))
    d = directions(rng, 300)
    p = target - d * rng.uniform(0, 3, (300, 1))
    span = evaluated(space, p, d, device)[3]
    for o, way, (near, far) in zip(p, d, span, strict=True):
        t = np.linspace(1e-3, 60, 3001)
        points = o + t[:, None] * way
        if space.kind == kernel.TAPER:
            ahead = points[:, 2] > 1e-3
            t, points = t[ahead], points[ahead]
        inside = (np.abs(space.to_grid(points)) <= 1).all(1)
        unclear = (np.abs(t - near) < 1e-2) | (np.abs(t - far) < 1e-2)
        np.testing.assert_array_equal(inside[~unclear], ((t > near) & (t < far))[~unclear])


def test_shells_far_out_are_no_scene_points_lost():
    # log1p and expm1 keep what lies right outside of the cube apart from its rim
    space = Space.shells()
    p = np.array([1.0 + 1e-12, 0.0, 0.0])
    assert space.to_scene(space.to_grid(p))[0] == pytest.approx(p[0], abs=1e-15)
