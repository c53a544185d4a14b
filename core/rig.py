"""How a capture's cameras stand: where they look, how far apart they are, and how deep the scene is.

Scene kind and normalisation are both decided from this. Every length is relative to the cameras' own spread and every
position to the first camera, so that the answers for a scene that is tiny, huge or far from its origin are the same.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from core.capture import View

# Pull of the guessed centre on the least-squares one: decides only where all axes lie within about 0.2 degrees.
GUESS_WEIGHT = 1e-5
# Depth of the scene where nothing tells it, in spreads of the cameras: a usual ratio of stereo baseline and depth.
GUESSED_DEPTH = 4.0
# Below it, the mean of the axes says nothing: the cameras look everywhere.
LEAST_MEAN_AXIS = 0.05
ONE_WAY_RAD = np.pi / 4
# Of the points' depths, on either side, taken for outliers.
OUTLIER_SHARE = 0.005
# Of the distance to what the cameras look at: where content may begin and end when neither bounds nor points tell it.
GUESSED_NEAR, GUESSED_FAR = 0.25, 25.0


@dataclass(frozen=True)
class Rig:
    """Attributes:
    origin: [3] float64, the first camera's position, in the capture's frame; the other positions are relative to it.
    positions, axes, rights, ups: [n, 3] float64 of the cameras; axes point along the view.
    depth_ranges: [m, 2] float64 (near, far), of the views that state one.
    points: [k, 3] float64, relative to `origin`; may be empty.
    """

    origin: np.ndarray
    positions: np.ndarray
    axes: np.ndarray
    rights: np.ndarray
    ups: np.ndarray
    depth_ranges: np.ndarray
    points: np.ndarray

    @classmethod
    def of(cls, views: Sequence[View], points: np.ndarray | None = None) -> Rig:
        """The rig of at least one view; points [k, 3] in the capture's frame."""
        poses = np.array([view.camera.world_from_camera for view in views])
        origin = poses[0, :3, 3].copy()
        ranges = np.array([view.depth_range for view in views if view.depth_range], np.float64).reshape(-1, 2)
        near_points = np.zeros((0, 3)) if points is None else np.asarray(points, np.float64) - origin
        rights, ups, backs = (poses[:, :3, column] for column in range(3))
        return cls(origin, poses[:, :3, 3] - origin, -backs, rights, ups, ranges, near_points)

    @cached_property
    def middle(self) -> np.ndarray:
        """[3]: the cameras' mean position, relative to `origin`."""
        return self.positions.mean(0)

    @cached_property
    def spread(self) -> float:
        """Root mean square distance of the cameras from their middle; 0 where they differ by rounding only."""
        spread = float(np.sqrt(((self.positions - self.middle) ** 2).sum(1).mean()))
        rounding = 64 * np.finfo(np.float64).eps * float(np.abs(self.origin).max() + np.abs(self.positions).max())
        return spread if spread > rounding else 0.0

    @cached_property
    def mean_axis(self) -> np.ndarray | None:
        """[3], unit: where the cameras look on average; None where they look everywhere."""
        mean = self.axes.mean(0)
        length = float(np.linalg.norm(mean))
        return mean / length if length > LEAST_MEAN_AXIS else None

    @cached_property
    def widest_angle_rad(self) -> float:
        """The largest angle between an optical axis and their mean; pi where there is no mean."""
        if self.mean_axis is None:
            return float(np.pi)
        across = np.linalg.norm(np.cross(self.axes, self.mean_axis), axis=1)
        return float(np.arctan2(across, self.axes @ self.mean_axis).max())

    @property
    def looks_one_way(self) -> bool:
        """Whether all optical axes lie within 45 degrees of their mean."""
        return self.widest_angle_rad <= ONE_WAY_RAD

    @cached_property
    def lateral_spread(self) -> float:
        """`spread` across the mean axis."""
        if self.mean_axis is None or self.spread == 0:
            return self.spread
        offsets = self.positions - self.middle
        along = offsets @ self.mean_axis
        return float(np.sqrt(np.maximum((offsets**2).sum(1) - along**2, 0.0).mean()))

    @cached_property
    def advance(self) -> float:
        """How far the foremost camera is in front of the cameras' middle, along the mean axis (0 without one)."""
        if self.mean_axis is None or self.spread == 0:
            return 0.0
        return float(((self.positions - self.middle) @ self.mean_axis).max())

    @cached_property
    def looked_at(self) -> np.ndarray:
        """[3], relative to `origin`: the point nearest to all optical axes (least squares).

        Where the axes are parallel it is guessed to lie in front of the cameras, four spreads away.
        """
        scale = self.spread or 1.0
        offsets = (self.positions - self.middle) / scale
        guess = np.zeros(3) if self.mean_axis is None else GUESSED_DEPTH * self.lateral_spread / scale * self.mean_axis
        projectors = np.eye(3) - self.axes[:, :, None] * self.axes[:, None, :]
        weight = GUESS_WEIGHT * len(offsets)
        system = projectors.sum(0) + weight * np.eye(3)
        target = (projectors @ offsets[:, :, None])[:, :, 0].sum(0) + weight * guess
        return self.middle + scale * np.linalg.solve(system, target)

    @cached_property
    def point_depths(self) -> np.ndarray:
        """Sorted depths of the points that lie in front, seen from the middle along the mean axis."""
        if self.mean_axis is None or not len(self.points):
            return np.zeros(0)
        depths = np.sort((self.points - self.middle) @ self.mean_axis)
        return depths[depths > 0]

    @cached_property
    def focus_depth(self) -> float:
        """Depth of what is looked at, from the cameras' middle along the mean axis; 0 where nothing tells it.

        By stated bounds (the middle of near and far in disparity), else points (their median), else where the axes
        meet; that one not nearer than twice the spread, because axes that only jitter meet at the cameras.
        """
        if len(self.depth_ranges):
            near, far = np.median(self.depth_ranges, axis=0)
            return float(2.0 * near * far / (near + far))
        if len(self.point_depths):
            return float(np.median(self.point_depths))
        if self.mean_axis is None:
            return 0.0
        met = float((self.looked_at - self.middle) @ self.mean_axis)
        return max(met, 2.0 * self.lateral_spread)

    @cached_property
    def near_far(self) -> tuple[float, float]:
        """(near, far): where content begins and ends, along the cameras' axes; (0, 0) where nothing tells it."""
        if len(self.depth_ranges):
            return float(self.depth_ranges[:, 0].min()), float(self.depth_ranges[:, 1].max())
        if len(self.points):
            depths = np.sort(self._depths_from_each_camera())
            if len(depths):
                low, high = np.quantile(depths, [OUTLIER_SHARE, 1 - OUTLIER_SHARE])
                return float(low), float(high)
        distance = float(np.median(np.linalg.norm(self.positions - self.looked_at, axis=1)))
        depth = self.focus_depth if self.looks_one_way else distance
        return GUESSED_NEAR * depth, GUESSED_FAR * depth

    def _depths_from_each_camera(self) -> np.ndarray:
        """Depths (> 0) of the points along each camera's axis, within 45 degrees of it; at most 2,000 points."""
        points = self.points[:: max(1, len(self.points) // 2000)]
        depths = []
        for position, axis in zip(self.positions, self.axes, strict=True):
            offsets = points - position
            depth = offsets @ axis
            depths.append(depth[depth > np.sqrt(0.5) * np.linalg.norm(offsets, axis=1)])
        return np.concatenate(depths)
