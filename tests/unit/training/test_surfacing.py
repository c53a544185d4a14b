"""From a voxel field to its mesh: one layer where it has a surface, more where rays end elsewhere, opacity by votes."""

import numpy as np
import pytest
import torch

from core.field.bricks import to_bricks
from core.field.parameters import Parameters
from core.field.region import find_region
from core.field.voxels import EMPTY_DENSITY, HIGHEST_DENSITY, VoxelField
from core.kernels.surfaces import Volume
from core.mesh.quad_mesh import VERTEX_REACH
from core.training import surfacing
from core.training.pixels import PixelPool
from core.training.surfacing import EXPLAINED, surfaced
from core.training.volume import sampled, volume_of
from tests.unit.training.captures import ball, capture_of

CELLS, NODES = 24, 96
CELL = 2.0 / CELLS
BALL, ROD = 0.5, 0.25 * CELL  # radii, in the scene's frame
ROD_XY = np.array([0.72, 0.1])


def density_at(points: np.ndarray, rod: bool) -> np.ndarray:
    inside = np.linalg.norm(points, axis=-1) < BALL
    if rod:
        across = np.linalg.norm(points[..., :2] - ROD_XY, axis=-1)
        inside |= (across < ROD) & (np.abs(points[..., 2]) < 0.5)
    return np.where(inside, HIGHEST_DENSITY, EMPTY_DENSITY)


class Scene:
    """A field made by hand: a ball, and beside it a rod half a cell thick."""

    def __init__(self, *, rod: bool) -> None:
        capture = capture_of(ball(radius=0.8), views=24, size_px=64)
        region = find_region(capture)
        axis = np.linspace(-1.0, 1.0, NODES)
        points = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), -1)
        scalar = to_bricks(torch.from_numpy(density_at(points, rod).astype(np.float32)))
        parameters = Parameters.starting_from(scalar, torch.full((len(scalar), 8), 0.5))
        self.field = VoxelField(region.space, NODES, parameters, torch.ones(32, 32, 32, dtype=torch.bool))
        self.pool = PixelPool(capture.train, region.frame, "cpu")
        cameras = [view.camera for view in capture.train]
        self.mesh, self.alpha = surfaced(self.field, self.pool, region.frame, cameras, CELLS, "cpu")
        self.vertices = self.mesh.vertices.numpy().astype(float)

    def volume_with(self, alpha: torch.Tensor) -> Volume:
        return volume_of(self.field.space, NODES, Parameters.starting_from(alpha, self.field.parameters.features))

    def opacity_at(self, points: np.ndarray) -> np.ndarray:
        volume = self.volume_with(self.alpha)
        return sampled(volume, torch.from_numpy(points.astype(np.float32)), "cpu")[0].numpy()


@pytest.fixture(scope="module")
def few_rays():
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(surfacing, "SURVEY_RAYS", 131_072)
        yield


@pytest.fixture(scope="module")
def round_scene(few_rays) -> Scene:
    return Scene(rod=False)


@pytest.fixture(scope="module")
def rod_scene(few_rays) -> Scene:
    return Scene(rod=True)


def test_a_solid_things_mesh_is_one_layer_on_its_surface(round_scene):
    away = np.abs(np.linalg.norm(round_scene.vertices, axis=1) - BALL) / CELL
    # Half a node of the field is an eighth of a cell, a picture's pixel a third. The rest stands around outlines, where
    # rays that graze the ball end elsewhere than they meet the mesh.
    assert np.quantile(away, 0.8) < 0.35
    # A sphere of r cells has 4 pi r^2 1.5 crossed edges: their directions' mean projected area is 3/2 of its own.
    expected = 4 * np.pi * (BALL / CELL) ** 2 * 1.5
    assert 0.9 * expected < len(round_scene.mesh.quads) < 1.6 * expected  # before, 6 layers


def test_vertices_stay_within_their_cells(rod_scene):
    moved = rod_scene.vertices - rod_scene.mesh.centres()
    assert np.abs(moved).max() <= VERTEX_REACH * CELL * (1 + 1e-5)


def test_the_surface_is_opaque(round_scene):
    middles = round_scene.vertices[round_scene.mesh.quads].mean(1)
    on_it = np.abs(np.linalg.norm(middles, axis=1) - BALL) < 0.35 * CELL
    assert on_it.sum() > 4 * np.pi * (BALL / CELL) ** 2
    assert (round_scene.opacity_at(middles[on_it]) > 0.5).mean() > 0.95


def near_rod(points: np.ndarray, cells: float) -> np.ndarray:
    across = np.linalg.norm(points[:, :2] - ROD_XY, axis=1)
    return (across < cells * CELL) & (np.abs(points[:, 2]) < 0.45)


def test_what_is_thinner_than_a_cell_gets_quads_of_its_own(rod_scene, round_scene):
    middles = rod_scene.vertices[rod_scene.mesh.quads].mean(1)
    assert near_rod(middles, 2.0).sum() > 2 * 0.9 / CELL
    assert near_rod(round_scene.vertices[round_scene.mesh.quads].mean(1), 1.0).sum() == 0


def rays_at_rod(count: int = 300) -> tuple[np.ndarray, np.ndarray]:
    """From all around, at the rod's axis."""
    rng = np.random.default_rng(3)
    turn = rng.uniform(-1.3, 1.3, count)  # not through the ball
    aim = np.column_stack([np.tile(ROD_XY, (count, 1)), rng.uniform(-0.4, 0.4, count)])
    origins = aim + 1.5 * np.column_stack([np.cos(turn), np.sin(turn), rng.uniform(-0.3, 0.3, count)])
    return origins, (aim - origins) / np.linalg.norm(aim - origins, axis=1, keepdims=True)


def met(scene: Scene, alpha: torch.Tensor) -> np.ndarray:
    """Share of the rays at the rod that meet something opaque within a cell of its axis."""
    origins, directions = rays_at_rod()
    tensors = (torch.from_numpy(a.astype(np.float32)) for a in (origins, directions))
    rays = surfacing.SurveyRays(*tensors, torch.zeros(1))
    tracer = surfacing.Tracer(scene.mesh, surfacing.VOLUME_KERNELS, len(origins), 1, 24)
    tracer.forward(rays, scene.volume_with(alpha), binary_only=True)
    opaque = (tracer.alpha > 0.5) & (torch.arange(24) < tracer.count[:, None])
    first = opaque.float().argmax(1)
    t = tracer.t[torch.arange(len(first)), first].numpy()
    place = origins + t[:, None] * directions
    return (opaque.any(1).numpy() & near_rod(place, 1.0)).mean()


def test_rays_at_a_thin_thing_meet_its_quads_and_find_them_opaque(rod_scene):
    assert met(rod_scene, torch.ones_like(rod_scene.alpha)) > 0.95
    assert met(rod_scene, rod_scene.alpha) > 0.8


def test_quads_beside_a_thin_thing_are_clear(rod_scene):
    middles = rod_scene.vertices[rod_scene.mesh.quads].mean(1)
    off_the_ball = np.linalg.norm(middles, axis=1) > BALL + CELL
    beside = near_rod(middles, 3.0) & ~near_rod(middles, 0.5 + EXPLAINED) & off_the_ball
    assert beside.any()
    assert (rod_scene.opacity_at(middles[beside]) < 0.5).mean() > 0.9


def test_the_same_field_gives_the_same_mesh(few_rays, rod_scene):
    again = Scene(rod=True)
    np.testing.assert_array_equal(again.mesh.quads, rod_scene.mesh.quads)
    assert torch.equal(again.mesh.vertices, rod_scene.mesh.vertices)
    assert torch.equal(again.alpha, rod_scene.alpha)


@pytest.mark.parametrize("known", [0, 1])
def test_values_spread_to_where_nothing_is_known(known):
    values, told = torch.full((6, 6, 6), 9.0), torch.zeros(6, 6, 6)
    if known:
        values[2, 2, 2], told[2, 2, 2] = 0.25, 1.0
    filled = surfacing._filled(values, told)
    assert bool((filled == (0.25 if known else -1.0)).all())
