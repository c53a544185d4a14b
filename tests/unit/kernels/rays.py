"""Rays that are easy to get wrong, and ordinary ones."""

from collections.abc import Sequence

import numpy as np
import torch

from core.training.pixels import Batch


def unit(vectors) -> np.ndarray:
    vectors = np.asarray(vectors, float)
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


def random_rays(rng: np.random.Generator, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Origins outside of the cube [count, 3], and directions to random points inside it."""
    origins = unit(rng.normal(size=(count, 3))) * rng.uniform(2.0, 4.0, (count, 1))
    return origins, unit(rng.uniform(-0.9, 0.9, (count, 3)) - origins)


def inside_rays(rng: np.random.Generator, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Rays from random points of the cube in random directions."""
    return rng.uniform(-0.8, 0.8, (count, 3)), unit(rng.normal(size=(count, 3)))


def axis_rays(rng: np.random.Generator, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Rays exactly along +-x, +-y, +-z through random places of the cube."""
    axis, sign = rng.integers(0, 3, count), rng.choice([-1.0, 1.0], count)
    directions = np.eye(3)[axis] * sign[:, None]
    return rng.uniform(-0.9, 0.9, (count, 3)) * (1 - np.eye(3)[axis]) - 3.0 * directions, directions


def plane_rays(rng: np.random.Generator, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Rays at right angles to one axis: one component of the direction is exactly 0."""
    origins, directions = random_rays(rng, count)
    flat = np.eye(3)[rng.integers(0, 3, count)]
    origins = origins * (1 - flat) + rng.uniform(-0.9, 0.9, (count, 1)) * flat
    return origins, unit(directions * (1 - flat))


def joined(*rays: tuple[np.ndarray, np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    return np.concatenate([o for o, _ in rays]), np.concatenate([d for _, d in rays])


def as_float32(rays: tuple[np.ndarray, np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """The rays as kernels will read them, so that an oracle gets the very same ones."""
    return rays[0].astype(np.float32), rays[1].astype(np.float32)


def batch_of(origins: Sequence, directions: Sequence, device: str = "cpu") -> Batch:
    """The rays as a training batch; its colours are not for use."""
    o, d = (torch.from_numpy(np.ascontiguousarray(a, np.float32)).to(device) for a in (origins, directions))
    nothing = torch.empty(0, device=device)
    return Batch(o, d, d, nothing, nothing, nothing)
