"""From a trained voxel field to the mesh that the field stage trains, and to how opaque it is at first.

Where the field has a surface the mesh is that surface: one layer, on it. What survey rays see and this layer does not
show (thin things, haze) gets the paper's other quads: cells around it, and all quads among them.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
import torch
import warp as wp
from torch import Tensor
from torch.nn import functional

from core.camera import Camera
from core.field.bricks import to_bricks
from core.field.frame import Frame, as_vec3, empty
from core.field.space import SHELLS
from core.field.voxels import DENSITY_SCALE, VoxelField
from core.kernels.fusion import DepthPictures, compare_depths, vote_opacity
from core.kernels.launch import accumulator_parts, launch
from core.kernels.surfaces import VOLUME_KERNELS, Volume
from core.kernels.types import FAR
from core.mesh.quad_mesh import FACES, VERTEX_REACH, QuadMesh, mesh_of, quads_between, shells_around
from core.mesh.surface import pulled_to_surface, surface_of
from core.training.depth_pictures import BAND, SurfaceDistance, depth_pictures, last_depths
from core.training.marcher import Marcher
from core.training.pixels import PixelPool
from core.training.survey import Survey
from core.training.tracer import Tracer
from core.training.volume import volume_of

SURVEY_RAYS, SURVEY_BATCH = 400_000, 8192
HIT_CAPACITY = 24
# The surface is looked for a little outside of where half of the pictures see it, so that what is hardly thicker than a
# cell holds together; its vertices then go where they belong. docs/training.md.
OUTSIDE = 0.15  # cells
# A ray is explained by a mesh that it meets so near to where the field ends it.
EXPLAINED = 0.5  # cells
# Cells where so many of the rays that end there, and so large a share, meet the mesh elsewhere get more quads.
UNEXPLAINED_RAYS, UNEXPLAINED_SHARE = 2, 0.15
# Hits this near to where the field ends a ray speak for opacity.
OPAQUE_NEAR = 0.5  # cells
# What the field's own density counts for, in rays, where rays say something else or nothing.
DENSITY_VOTES = 0.2
SHELL_WEIGHT = 0.01  # least weight that a ray must see near a shell's cell


@dataclass(frozen=True)
class SurveyRays:
    """Survey rays [n, 3] in the scene's frame, and where the field ends each, or FAR [n]."""

    origins: Tensor
    directions: Tensor
    depth: Tensor


def surfaced(
    field: VoxelField, pool: PixelPool, frame: Frame, cameras: Sequence[Camera], cells: int, device: str
) -> tuple[QuadMesh, Tensor]:
    """(mesh, opacity [places] of the field's nodes on it).

    Args:
        pool: pixels to survey, of the photos that the field was trained on; cameras: theirs, in the object frame.
        frame: of the field.
        cells: P, per axis.

    Raises:
        TrainingFailed: no quad is found.
    """
    marcher = Marcher(field, device)
    survey, rays = _surveyed(marcher, pool, cells)
    corners, places = _surface(depth_pictures(marcher, cameras, frame), field, cells, device)
    shells = _seen_shells(survey)
    if len(corners):
        met = _first_hits(mesh_of(corners, places, cells, device, field.space), field, rays)
    else:
        met = torch.full_like(rays.depth, float(FAR))
    every, missed = _ends(field, rays, cells, met)
    missing = (missed >= UNEXPLAINED_RAYS) & (missed > UNEXPLAINED_SHARE * every)
    near = functional.max_pool3d(missing.float()[None, None], 3, 1, 1)[0, 0] > 0
    more = quads_between(near.cpu().numpy())
    more = more[missing.reshape(-1).cpu().numpy()[more].any(1)]
    places = np.where(np.isfinite(places), places, survey.centroids())
    mesh = mesh_of(np.concatenate([corners, more]), places, cells, device, field.space, shells)
    return mesh, _opacity(mesh, field, rays)


def _surveyed(marcher: Marcher, pool: PixelPool, cells: int) -> tuple[Survey, SurveyRays]:
    field, device = marcher.field, marcher.device
    survey = Survey.empty(cells, shells_around(field.space, cells) if field.space.kind == SHELLS else -1, device)
    jitter = torch.full((SURVEY_BATCH,), 0.5, device=device)
    seen = []
    for number in range(SURVEY_RAYS // SURVEY_BATCH):
        batch = pool.draw(number, SURVEY_BATCH, supersampled=False)
        marcher.forward(batch.origins, batch.directions, jitter)
        marcher.survey(batch.origins, batch.directions, survey)
        seen.append((batch.origins, batch.directions, last_depths(marcher)))
    return survey, SurveyRays(*(torch.cat(parts) for parts in zip(*seen, strict=True)))


def _seen_shells(survey: Survey) -> np.ndarray:
    return (survey.shell_peak.amax(0) > SHELL_WEIGHT).cpu().numpy().reshape(-1, FACES, survey.cells, survey.cells)


def _surface(pictures: DepthPictures, field: VoxelField, cells: int, device: str) -> tuple[np.ndarray, np.ndarray]:
    """(quads [n, 4], places [P^3, 3]) as `surface_of`, with vertices on the surface itself."""
    from_outside, distance = (SurfaceDistance(pictures, field.space, cells, device, level) for level in (OUTSIDE, 0.0))
    quads, places = surface_of(_at_corners(from_outside, field, cells), from_outside)
    used = np.unique(quads)
    places[used] = pulled_to_surface(places[used], used, cells, distance, BAND, VERTEX_REACH)
    return quads, places


def _at_corners(distance: SurfaceDistance, field: VoxelField, cells: int) -> np.ndarray:
    """[P + 1, P + 1, P + 1] distances at the cells' corners. Far from all that the field holds is outside; of what no
    picture sees near it, the neighbours tell."""
    near = torch.from_numpy(_near_corners(field, cells))
    ijk = near.nonzero().numpy()
    found, known = distance.known(ijk * (2.0 / cells) - 1.0)
    values, told = torch.ones(near.shape), torch.ones(near.shape)
    values[near] = torch.from_numpy(found).float()
    told[near] = torch.from_numpy(known).float()
    return _filled(values, told).numpy().astype(np.float64)


def _near_corners(field: VoxelField, cells: int) -> np.ndarray:
    """[P + 1]^3 bool: corners at or beside cells of the occupancy grid that hold something."""
    axis = np.arange(cells + 1) * (2.0 / cells) - 1.0
    points = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), -1)
    grid = field.space.to_grid(field.space.cells_to_scene(points)) if field.space.kind == SHELLS else points
    occupied = functional.max_pool3d(field.occupied.float().cpu()[None, None], 3, 1, 1)[0, 0].numpy() > 0
    n = len(occupied)
    i, j, k = np.moveaxis(np.clip(((grid + 1.0) * 0.5 * n).astype(int), 0, n - 1), -1, 0)
    return occupied[i, j, k]


def _filled(values: Tensor, told: Tensor) -> Tensor:
    """Values [n, n, n] where told (1, else 0), spread to where not, layer by layer; -1 in what nothing reaches."""
    values, told = values * told, told.clone()
    while not told.all():
        sums, counts = (functional.avg_pool3d(grid[None, None], 3, 1, 1)[0, 0] * 27.0 for grid in (values, told))
        new = (told == 0) & (counts > 0.5)
        if not new.any():
            break
        values[new] = (sums / counts)[new]
        told[new] = 1.0
    return torch.where(told > 0, values, -1.0)


def _ends(field: VoxelField, rays: SurveyRays, cells: int, met: Tensor) -> tuple[Tensor, Tensor]:
    """(rays that end in each cell [P, P, P], those of them that meet the mesh, at `met` [n], elsewhere or nowhere)."""
    device = str(rays.depth.device)
    apart, cell = empty(len(rays.depth), device=device), empty(len(rays.depth), device=device, dtype=torch.int32)
    inputs = [field.space.kernel_space(), cells, as_vec3(rays.origins), as_vec3(rays.directions),
              *(wp.from_torch(tensor) for tensor in (rays.depth, met, apart, cell))]  # fmt: skip
    launch(compare_depths, len(rays.depth), inputs, device)
    elsewhere = apart > EXPLAINED * 2.0 / cells
    counts = (torch.bincount(cell[which].long(), minlength=cells**3) for which in (cell >= 0, (cell >= 0) & elsewhere))
    every, missed = (count.reshape((cells,) * 3) for count in counts)
    return every, missed


def _first_hits(mesh: QuadMesh, field: VoxelField, rays: SurveyRays) -> Tensor:
    """[n] distances at which rays meet a mesh, or FAR."""
    tracer = _tracer_of(mesh)
    opaque = _volume_with(field, 1.0)
    first = []
    for some in _batches(rays):
        tracer.forward(some, opaque, binary_only=True)
        first.append(torch.where(tracer.count > 0, tracer.t[:, 0], torch.full_like(tracer.t[:, 0], float(FAR))))
    return torch.cat(first)


def _opacity(mesh: QuadMesh, field: VoxelField, rays: SurveyRays) -> Tensor:
    """[places]: how much of what survey rays say of a node says that it is opaque: they meet the mesh near it where
    they end, or before."""
    parameters, device = field.parameters, str(rays.depth.device)
    tracer, clear = _tracer_of(mesh), _volume_with(field, 0.0)
    parts = accumulator_parts(device)
    votes = [torch.zeros(parts, len(parameters.trained), device=device) for _ in range(2)]
    for some in _batches(rays):
        tracer.forward(some, clear, binary_only=False)
        inputs = [field.space.kernel_space(), field.nodes, wp.from_torch(parameters.row_of), as_vec3(some.origins),
                  as_vec3(some.directions), wp.from_torch(some.depth), OPAQUE_NEAR * mesh.cell_size,
                  tracer.hits]  # fmt: skip
        launch(vote_opacity, len(some.depth), partial(_with_votes, inputs, votes), device, parts)
    # A quad stands for the matter within about a cell of it.
    density = parameters.scalar.clamp_min(0.0)
    alpha = 1.0 - torch.exp(-density * (DENSITY_SCALE * mesh.cell_size * field.space.inner))
    alpha[to_bricks(torch.from_numpy(field.space.backdrop(field.nodes))).to(device)] = 1.0
    rows = parameters.trained.long()
    for_it, against = (vote.sum(0) for vote in votes)
    alpha[rows] = (for_it + DENSITY_VOTES * alpha[rows]) / (for_it + against + DENSITY_VOTES)
    return alpha


def _with_votes(inputs: list[Any], votes: list[Tensor], part: int) -> list[Any]:
    return [*inputs, part, *(wp.from_torch(vote) for vote in votes)]


def _tracer_of(mesh: QuadMesh) -> Tracer:
    return Tracer(mesh, VOLUME_KERNELS, SURVEY_BATCH, 1, HIT_CAPACITY)


def _volume_with(field: VoxelField, alpha: float) -> Volume:
    """The field's volume, equally opaque everywhere."""
    everywhere = torch.full_like(field.parameters.scalar, alpha)
    return volume_of(field.space, field.nodes, replace(field.parameters, scalar=everywhere))


def _batches(rays: SurveyRays) -> Iterator[SurveyRays]:
    """As many at once as were surveyed at once."""
    split = (tensor.split(SURVEY_BATCH) for tensor in (rays.origins, rays.directions, rays.depth))
    return (SurveyRays(*parts) for parts in zip(*split, strict=True))
