"""Where the scene is: its parameterisation, the training frame, and the cells that it may fill.

An object's photos with an alpha channel say it outright: a cell that some photo sees only as transparent is empty (the
visual hull). Other scenes fill what at least two photos see, but for the air right before the lenses.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
import torch
from torch import Tensor
from torch.nn import functional

from core.capture import Capture, View
from core.errors import CaptureEmpty
from core.field.frame import Frame
from core.field.space import Space
from core.rig import Rig
from core.scene_kind import FORWARD, UNBOUNDED

HULL_CELLS = 64
# The box around the object is found from coarse to fine: each look's cells are a part of the box before.
SEARCH_CELLS = (32, 64, 96)
SEARCH_VIEWS = 32  # for the box; the hull itself is carved by all photos
# Of the distance from the looked-at point to the nearest camera: how far the first search reaches.
SEARCH_REACH = 0.95
# What fewer photos than this share see cannot be reconstructed.
SEEN_SHARE = 0.1
# The box is drawn around what half of the photos see. (With a tenth, the cone that the object hides from the highest
# cameras counts too, and the box of a capture from above grows threefold.)
SEARCH_SHARE = 0.5
# Without alpha: of the median camera distance, what is taken for the object.
REACH_WITHOUT_ALPHA = 0.5
# Room around the hull, so that vertices at its rim can move outwards.
MARGIN = 1.04


# Forward-facing: the grid begins at this share of the nearest depth, and ends at this multiple of the farthest.
NEAR_SHARE, FAR_SHARE = 0.9, 1.1
LEAST_DEPTHS, MOST_DEPTHS = 1.5, 100.0
# Unbounded: the cube is this much larger than what holds all cameras.
CAMERA_MARGIN = 1.1
# Nothing is taken to be nearer to a camera than this share of its distance from what all look at.
CLEAR_SHARE = 0.1


@dataclass(frozen=True)
class Region:
    """Attributes:
    frame: from the object frame to the scene's.
    hull: [64, 64, 64] bool, cells of the grid that may hold something.
    space: where the grid lies in the scene's frame.
    """

    frame: Frame
    hull: np.ndarray
    space: Space = field(default_factory=Space.cube)


def find_region(capture: Capture) -> Region:
    """The region of a capture, by its kind.

    Raises:
        CaptureEmpty: the photos' masks have no point in common.
    """
    if capture.kind.name == FORWARD:
        return _forward_region(capture)
    if capture.kind.name == UNBOUNDED:
        return _unbounded_region(capture)
    return _object_region(capture)


def _forward_region(capture: Capture) -> Region:
    """The cameras' mean axis is +z, the nearest depth is 1; wide enough for all that the photos show."""
    rig = Rig.of(capture.train, capture.points)
    rotation, centre = _facing(capture.train), rig.origin + rig.middle
    depths = [np.array(view.depth_range) for view in capture.train if view.depth_range is not None]
    near, far = (min(d[0] for d in depths), max(d[1] for d in depths)) if depths else rig.near_far
    half = NEAR_SHARE * near
    reach = float(np.clip(FAR_SHARE * far / half, LEAST_DEPTHS, MOST_DEPTHS))
    frame = Frame(centre, half, rotation)
    space = Space.taper(_tangents(capture.train, frame, reach), reach)
    return Region(frame, _commonly_seen(capture.train, frame, space), space)


def _facing(views: Sequence[View]) -> np.ndarray:
    """[3, 3], columns are x to the right, y down and z ahead of the mean camera, in the object frame."""
    ahead = -np.mean([view.camera.world_from_camera[:3, 2] for view in views], 0)
    up = np.mean([view.camera.world_from_camera[:3, 1] for view in views], 0)
    z = ahead / np.linalg.norm(ahead)
    x = np.cross(z, up)
    if np.linalg.norm(x) < 1e-6:  # the cameras are turned against each other about their axes
        x = np.cross(z, np.eye(3)[np.argmin(np.abs(z))])
    x = x / np.linalg.norm(x)
    return np.stack([x, np.cross(z, x), z], 1)


def _tangents(views: Sequence[View], frame: Frame, reach: float) -> tuple[float, float]:
    """Half width and half height, per depth, of all that the photos show between depths 1 and reach."""
    widest = np.zeros(2)
    for view in views:
        width, height = view.camera.size_px
        corners = np.array([[0, 0], [width, 0], [0, height], [width, height]], float)
        directions = view.camera.directions(corners) @ frame.rotation
        origin = frame.to_scene(view.camera.position)
        ahead = directions[:, 2] > 1e-3
        for depth in (1.0, reach):
            points = origin + directions[ahead] * ((depth - origin[2]) / directions[ahead, 2])[:, None]
            widest = np.maximum(widest, np.abs(points[:, :2]).max(0, initial=0.0) / depth)
    return float(max(widest[0], 1e-3)), float(max(widest[1], 1e-3))


def _unbounded_region(capture: Capture) -> Region:
    """The cube around what all look at that holds all cameras, and shells around it."""
    rig = Rig.of(capture.train, capture.points)
    centre = rig.origin + rig.looked_at
    away = np.abs(rig.positions - rig.looked_at).max(1)
    half = CAMERA_MARGIN * float(away.max()) or 1.0
    frame = Frame(centre, half)
    space = Space.shells()
    return Region(frame, _commonly_seen(capture.train, frame, space), space)


def _commonly_seen(views: Sequence[View], frame: Frame, space: Space) -> np.ndarray:
    """[64]^3 bool: cells of the grid within at least two photos, not right before a lens; of the backdrop, all."""
    ticks = (np.arange(HULL_CELLS) + 0.5) * (2.0 / HULL_CELLS) - 1.0
    grid = np.stack(np.meshgrid(ticks, ticks, ticks, indexing="ij"), -1).reshape(-1, 3)
    points = frame.to_object(space.to_scene(grid))
    clear = CLEAR_SHARE * np.array([np.linalg.norm(view.camera.position - frame.centre) for view in views])
    seen, blocked = np.zeros(len(points), np.int32), np.zeros(len(points), bool)
    for view, radius in zip(views, clear, strict=True):
        camera = view.camera
        local = (points - camera.position) @ camera.world_from_camera[:3, :3]
        depth = np.maximum(-local[:, 2], 1e-12)
        x = local[:, 0] / depth * camera.focal_px[0] + camera.centre_px[0]
        y = camera.centre_px[1] - local[:, 1] / depth * camera.focal_px[1]
        width, height = camera.size_px
        seen += (local[:, 2] < 0) & (x >= 0) & (y >= 0) & (x < width) & (y < height)
        blocked |= (local**2).sum(-1) < radius**2
    return ((seen >= 2) & ~blocked).reshape((HULL_CELLS,) * 3) | space.backdrop(HULL_CELLS)


def _object_region(capture: Capture) -> Region:
    centre, distances = _looked_at(capture.train)
    everything = np.ones((HULL_CELLS,) * 3, bool)
    if not capture.has_alpha:
        return Region(Frame(centre, REACH_WITHOUT_ALPHA * float(np.median(distances))), everything)
    frame = Frame(centre, SEARCH_REACH * float(distances.min()))
    some = capture.train[:: max(1, len(capture.train) // SEARCH_VIEWS)]
    for cells in SEARCH_CELLS:
        frame = _enclosing(frame, visual_hull(some, frame, cells, SEARCH_SHARE))
    return Region(frame, visual_hull(capture.train, frame))


def visual_hull(views: Sequence[View], frame: Frame, cells: int = HULL_CELLS, share: float = SEEN_SHARE) -> np.ndarray:
    """[cells]^3 bool: cells of the cube that no photo shows to be empty. Conservative: thin parts stay.

    Args:
        share: of the photos, that a cell must be within.
    """
    ticks = (np.arange(cells) + 0.5) * (2.0 / cells) - 1.0
    grid = np.stack(np.meshgrid(ticks, ticks, ticks, indexing="ij"), -1).reshape(-1, 3)
    points = torch.from_numpy(frame.to_object(grid).astype(np.float32))
    radius = np.sqrt(3.0) / cells * frame.half
    alive = torch.ones(len(points), dtype=torch.bool)
    seen = torch.zeros(len(points), dtype=torch.int32)
    for view in views:
        index = alive.nonzero()[:, 0]
        inside, filled = _look(view, points[index], radius)
        seen[index] += inside
        alive[index] &= filled | ~inside
    alive &= seen >= max(2, share * len(views))
    return alive.reshape(cells, cells, cells).numpy()


def _look(view: View, points: Tensor, radius: float) -> tuple[Tensor, Tensor]:
    """(whether each point is within the photo, whether the ball around it may touch the photo's mask)."""
    camera = view.camera
    to_camera = torch.from_numpy(np.linalg.inv(camera.world_from_camera).astype(np.float32))
    local = points @ to_camera[:3, :3].T + to_camera[:3, 3]
    depth = -local[:, 2]
    in_front = depth > 2.0 * radius
    safe = torch.where(in_front, depth, torch.ones_like(depth))
    x = local[:, 0] / safe * camera.focal_px[0] + camera.centre_px[0]
    y = -local[:, 1] / safe * camera.focal_px[1] + camera.centre_px[1]
    width, height = camera.size_px
    inside = in_front & (x >= 0) & (y >= 0) & (x < width) & (y < height)
    if not inside.any():
        return inside, inside
    reach_px = radius * max(camera.focal_px) / safe
    level = torch.ceil(torch.log2(reach_px.clamp_min(1.0))).int()
    filled = torch.ones_like(inside)  # so close to the camera that the ball may fill the photo
    solid = view.image_u8[..., 3] > 0
    for k in range(max(width, height).bit_length() - 1):
        at = (inside & (level == k)).nonzero()[:, 0]
        if len(at):
            mask = _touched_blocks(solid, 2**k)
            filled[at] = mask[(y[at] / 2**k).long(), (x[at] / 2**k).long()]
    return inside, filled


def _touched_blocks(mask: np.ndarray, block: int) -> Tensor:
    """[ceil(h / block), ceil(w / block)] bool: whether a block or one of its eight neighbours has a true pixel."""
    image = torch.from_numpy(mask.astype(np.float32))[None, None]
    pooled = functional.max_pool2d(image, block, block, ceil_mode=True)
    return functional.max_pool2d(pooled, 3, 1, 1)[0, 0] > 0


def _enclosing(frame: Frame, hull: np.ndarray) -> Frame:
    filled = np.argwhere(hull)
    if len(filled) == 0:
        raise CaptureEmpty(
            "capture",
            "the photos must have something in common",
            "masks without a common point in space",
            "Check that the poses belong to these photos and follow the camera-to-world OpenGL convention.",
        )
    size = 2.0 / hull.shape[0]
    low, high = filled.min(0) * size - 1.0, (filled.max(0) + 1) * size - 1.0
    half = float((high - low).max()) / 2.0 * MARGIN
    return Frame(frame.to_object((low + high) / 2.0), frame.half * half)


def _looked_at(views: Sequence[View]) -> tuple[np.ndarray, np.ndarray]:
    """The point nearest to all optical axes (least squares), and the cameras' distances from it."""
    origins = np.array([view.camera.position for view in views])
    axes = np.array([-view.camera.world_from_camera[:3, 2] for view in views])
    projectors = np.eye(3) - axes[:, :, None] * axes[:, None, :]
    # A little weight on the cameras' mean keeps the system solvable when all axes are parallel.
    system = projectors.sum(0) + 1e-6 * len(views) * np.eye(3)
    target = (projectors @ origins[:, :, None])[:, :, 0].sum(0) + 1e-6 * len(views) * origins.mean(0)
    centre = np.linalg.solve(system, target)
    distances = np.linalg.norm(origins - centre, axis=1)
    return centre, np.maximum(distances, 1e-12 + 1e-6 * float(np.abs(origins).max()))
