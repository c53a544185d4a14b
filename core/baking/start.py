"""Which of the shipped cameras a viewer should start from."""

from collections.abc import Sequence

import numpy as np

from core.camera import Camera
from core.scene_kind import FORWARD, OBJECT


def start_camera(cameras: Sequence[Camera], kind: str) -> int | None:
    """Index among `cameras` [at least one] for a scene of this kind (core.scene_kind's names).

    None for an object, which can be looked at from anywhere. A forward-facing scene opens in the middle of where it was
    photographed, with most room to move. In an unbounded one the middle is where the photos look at, not where they
    were taken: any photo will do, so the first.
    """
    if kind == OBJECT or not cameras:
        return None
    if kind != FORWARD:
        return 0
    positions = np.array([camera.position for camera in cameras])
    return int(np.argmin(np.linalg.norm(positions - positions.mean(0), axis=1)))
