"""A pinhole camera in the object frame."""

from dataclasses import dataclass, replace

import numpy as np

from core.errors import PoseNotFinite, PoseNotRigid, PosesInvalid

# Poses come with 6 to 8 digits from files, and some tools orthonormalise loosely; a mirroring or a scale is far off.
RIGID_TOLERANCE = 1e-3


@dataclass(frozen=True)
class Camera:
    """Where a photo was taken from, and its lens.

    Attributes:
        name: the photo's name without folder and suffix.
        world_from_camera: [4, 4] float64, rigid, OpenGL camera axes, in the object frame.
        focal_px: (fx, fy), > 0.
        centre_px: (cx, cy); pixel (0, 0) has its centre at (0.5, 0.5).
        size_px: (width, height).

    Raises:
        PoseNotFinite, PoseNotRigid, PosesInvalid
    """

    name: str
    world_from_camera: np.ndarray
    focal_px: tuple[float, float]
    centre_px: tuple[float, float]
    size_px: tuple[int, int]

    def __post_init__(self) -> None:
        matrix = np.asarray(self.world_from_camera, np.float64)
        if matrix.shape == (3, 4):
            matrix = np.vstack([matrix, [0.0, 0.0, 0.0, 1.0]])
        object.__setattr__(self, "world_from_camera", matrix)
        _check_pose(self.name, matrix)
        intrinsics = np.array([*self.focal_px, *self.centre_px])
        if not np.isfinite(intrinsics).all() or min(self.focal_px) <= 0 or min(self.size_px) < 1:
            raise PosesInvalid(
                f"camera of {self.name}",
                "focal lengths must be finite and positive, the size at least 1 px",
                f"focal {self.focal_px}, centre {self.centre_px}, size {self.size_px}",
                "Correct the intrinsics in the pose file.",
            )

    @property
    def position(self) -> np.ndarray:
        """[3] float64, object frame."""
        return self.world_from_camera[:3, 3]

    def resized(self, size_px: tuple[int, int]) -> "Camera":
        """The same camera with a photo of another size (width, height); pixels scale about the image's corner."""
        sx, sy = size_px[0] / self.size_px[0], size_px[1] / self.size_px[1]
        return replace(
            self,
            focal_px=(self.focal_px[0] * sx, self.focal_px[1] * sy),
            centre_px=(self.centre_px[0] * sx, self.centre_px[1] * sy),
            size_px=size_px,
        )

    def directions(self, pixels_xy: np.ndarray) -> np.ndarray:
        """Unit directions [..., 3] (float64, object frame) through points [..., 2] of the image plane, in pixels."""
        x = (pixels_xy[..., 0] - self.centre_px[0]) / self.focal_px[0]
        y = -(pixels_xy[..., 1] - self.centre_px[1]) / self.focal_px[1]
        camera = np.stack([x, y, -np.ones_like(x)], -1)
        world = camera @ self.world_from_camera[:3, :3].T
        return world / np.linalg.norm(world, axis=-1, keepdims=True)

    def pixel_centres(self) -> np.ndarray:
        """[height, width, 2] float64, (x, y) of every pixel centre."""
        width, height = self.size_px
        x, y = np.meshgrid(np.arange(width) + 0.5, np.arange(height) + 0.5)
        return np.stack([x, y], -1)


def _check_pose(name: str, matrix: np.ndarray) -> None:
    if matrix.shape != (4, 4):
        raise PosesInvalid(
            f"pose of {name}", "must be a 3x4 or 4x4 matrix", f"shape {matrix.shape}", "Export the poses again."
        )
    if not np.isfinite(matrix).all():
        raise PoseNotFinite(
            f"pose of {name}",
            "every entry must be a finite number",
            f"{np.count_nonzero(~np.isfinite(matrix))} entries that are NaN or infinite",
            "Leave this photo out of the pose file, or pose it again.",
        )
    rotation = matrix[:3, :3]
    error = max(np.abs(rotation @ rotation.T - np.eye(3)).max(), abs(np.linalg.det(rotation) - 1.0))
    if error > RIGID_TOLERANCE or not np.allclose(matrix[3], [0, 0, 0, 1], atol=RIGID_TOLERANCE):
        raise PoseNotRigid(
            f"pose of {name}",
            "must be a rotation and a translation, without scale, shear or mirroring",
            f"a matrix {error:.3g} away from rigid (at most {RIGID_TOLERANCE:g} is allowed)",
            "Export camera-to-world matrices, and apply scene scaling to the translations only.",
        )
