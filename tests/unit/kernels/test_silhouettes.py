"""The gradient of silhouettes against what moving the outline does to the picture."""

import numpy as np
import pytest
import torch

from core.conventions import SUBPIXEL_OFFSETS_PX
from core.field.frame import as_vec3
from core.field.space import Space
from core.kernels.launch import accumulator_parts
from core.kernels.surfaces import TEXEL_KERNELS
from core.mesh.quad_mesh import QuadMesh, shells_around
from core.training.tracer import Tracer
from tests.unit.kernels.meshes import build_mesh, texels_of
from tests.unit.kernels.rays import batch_of

P = 8
PIXEL = 0.02  # in the scene, where parallel rays along -z meet the sheet
GAP = 0.1
F_SHEET = np.array([0.8, 0.1, 0.3, 0.5, 0.2, 0.9, 0.4, 0.6])


def sheet(side: int, height: int = P // 2, device: str = "cpu") -> QuadMesh:
    """A flat square of quads at right angles to z, between cells' centres."""
    solid = np.zeros((P,) * 3, bool)
    low = (P - side) // 2
    solid[low : low + side, low : low + side, height] = True
    ticks = (np.arange(P) + 0.5) * (2.0 / P) - 1.0
    centres = np.stack(np.meshgrid(ticks, ticks, ticks, indexing="ij"), -1)
    return build_mesh(solid, centres, device)


def pixels_over(rng: np.random.Generator, device: str, jitter: int = 6):
    """Parallel sub-rays of pixels all over the square, at several places within a pixel: a batch of four a pixel."""
    ticks = np.arange(-1.0, 1.0, PIXEL)
    x, y = (a.reshape(-1) for a in np.meshgrid(ticks, ticks))
    centres = np.concatenate([np.column_stack([x, y]) + rng.random((1, 2)) * PIXEL for _ in range(jitter)])
    points = centres[:, None] + SUBPIXEL_OFFSETS_PX * PIXEL
    flat = points.reshape(-1, 2)
    origins = np.column_stack([flat, np.full(len(flat), 3.0)])
    directions = np.tile([0.0, 0.0, -1.0], (len(flat), 1))
    return batch_of(origins, directions, device), jitter


def gradient(mesh: QuadMesh, batch, features: np.ndarray, gF: np.ndarray, gA: float, alpha=None) -> np.ndarray:
    """[V, 3] of sum over pixels of gF . F + gA A, for the binary model."""
    device = str(mesh.vertices.device)
    shape = (len(mesh.quads), 2, 2)
    alpha = np.ones(shape) if alpha is None else alpha
    surface = texels_of(alpha, np.broadcast_to(features, (*shape, 8)), device)
    pixels = len(batch.origins) // 4
    tracer = Tracer(mesh, TEXEL_KERNELS, pixels, 4, 8)
    tracer.forward(batch, surface, binary_only=True)
    grads = (
        torch.from_numpy(np.broadcast_to(gF, (pixels, 8)).astype(np.float32)).contiguous().to(device),
        torch.full((pixels,), gA, device=device),
    )
    parts = accumulator_parts(device)
    total = torch.zeros(parts, *mesh.vertices.shape, device=device)
    tracer.silhouettes(batch, grads, GAP, parts, as_vec3(total))
    return total.sum(0).cpu().numpy()


@pytest.mark.parametrize(("gF", "gA"), [(np.zeros(8), 1.0), (np.arange(8) / 8.0, 0.0), (-np.ones(8), 0.5)])
def test_growing_a_square_changes_the_sum_of_its_pixels_as_the_gradient_says(rng, device, gF, gA):
    mesh = sheet(4, device=device)
    batch, rounds = pixels_over(rng, device)
    found = gradient(mesh, batch, F_SHEET, gF, gA) / rounds
    places = mesh.vertices.cpu().numpy()
    outward = float((found * places)[:, :2].sum())  # dL when the square grows by its own size
    half = np.abs(places[:, :2]).max()
    # An area of (2 half)^2 grows by 2 (2 half)^2; a pixel is as much as its area.
    expected = 2.0 * (2.0 * half) ** 2 / PIXEL**2 * (gA + gF @ F_SHEET)
    assert outward == pytest.approx(expected, rel=0.05)  # the outline meets about 100 pixels a side, at six places
    assert np.abs(found[:, 2]).max() < 1e-3 * np.abs(found).max()


def test_a_surface_with_nothing_but_itself_around_has_no_silhouette(rng, device):
    mesh = sheet(6, device=device)
    inside = np.abs(rng.uniform(-0.5, 0.5, (200, 1, 2)))
    points = (inside + SUBPIXEL_OFFSETS_PX * PIXEL).reshape(-1, 2)
    origins = np.column_stack([points, np.full(len(points), 3.0)])
    batch = batch_of(origins, np.tile([0.0, 0.0, -1.0], (len(points), 1)), device)
    assert np.abs(gradient(mesh, batch, F_SHEET, np.ones(8), 1.0)).max() == 0.0


def test_rays_that_meet_nothing_move_nothing(device):
    origins = np.tile([0.95, 0.95, 3.0], (8, 1))
    batch = batch_of(origins, np.tile([0.0, 0.0, 1.0], (8, 1)), device)
    assert np.abs(gradient(sheet(4, device=device), batch, F_SHEET, np.ones(8), 1.0)).max() == 0.0


def test_what_looks_like_its_background_has_no_reason_to_move(rng, device):
    """A square before a larger one of the same features."""
    solid = np.zeros((P,) * 3, bool)
    solid[2:6, 2:6, 5] = True
    solid[1:7, 1:7, 2] = True
    ticks = (np.arange(P) + 0.5) * (2.0 / P) - 1.0
    centres = np.stack(np.meshgrid(ticks, ticks, ticks, indexing="ij"), -1)
    mesh = build_mesh(solid, centres, device)
    batch, _ = pixels_over(rng, device, 1)
    found = gradient(mesh, batch, F_SHEET, np.ones(8), 1.0)
    near = mesh.vertices.cpu().numpy()[:, 2] > 0.2
    assert np.abs(found[near]).max() == 0.0
    assert np.abs(found[~near]).max() > 0.0  # its own outline, before nothing


def test_transparent_texels_have_no_silhouette(rng, device):
    mesh = sheet(4, device=device)
    batch, _ = pixels_over(rng, device, 1)
    clear = np.zeros((len(mesh.quads), 2, 2))
    assert np.abs(gradient(mesh, batch, F_SHEET, np.ones(8), 1.0, clear)).max() == 0.0


@pytest.mark.parametrize("subrays", [1, 2])
def test_pixels_without_four_sub_rays_move_nothing(rng, device, subrays):
    """The kernel would read beyond the rays."""
    mesh = sheet(4, device=device)
    batch, _ = pixels_over(rng, device, 1)
    pixels = len(batch.origins) // subrays
    shape = (len(mesh.quads), 2, 2)
    tracer = Tracer(mesh, TEXEL_KERNELS, pixels, subrays, 8)
    tracer.forward(batch, texels_of(np.ones(shape), np.ones((*shape, 8)), device), binary_only=True)
    grads = torch.ones(pixels, 8, device=device), torch.ones(pixels, device=device)
    parts = accumulator_parts(device)
    total = torch.zeros(parts, *mesh.vertices.shape, device=device)
    tracer.silhouettes(batch, grads, GAP, parts, as_vec3(total))
    assert float(total.abs().max()) == 0.0


def test_shells_have_an_outline_and_stay_all_the_same(rng, device):
    """Half of one face of a shell is there: rays from the middle pass its border."""
    space = Space.shells()
    shells = np.zeros((shells_around(space, P) + 1, 6, P, P), bool)
    shells[1, 1, : P // 2] = True  # of +x, where y < 0
    mesh = build_mesh(np.zeros((P,) * 3, bool), np.full((P, P, P, 3), np.nan), device, space, shells)
    across = np.column_stack([rng.uniform(-0.02, 0.02, 400), rng.uniform(-0.5, 0.5, 400)])
    yz = (across[:, None] + SUBPIXEL_OFFSETS_PX * 0.02).reshape(-1, 2)
    directions = np.column_stack([np.ones(len(yz)), yz])
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    batch = batch_of(np.zeros_like(directions), directions, device)
    assert np.abs(gradient(mesh, batch, F_SHEET, np.ones(8), 1.0)).max() == 0.0
