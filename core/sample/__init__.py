"""A capture that Polyfield renders itself, deterministic from a seed, so that nothing needs downloading."""

from __future__ import annotations

import numpy as np

from core.camera import Camera
from core.sample.capture_writer import write_sample_capture
from core.sample.studio import Studio

__all__ = ["Studio", "sample_depth", "write_sample_capture"]


def sample_depth(camera: Camera, seed: int = 0) -> np.ndarray:
    """The true depth of a sample photo: [height, width] float32, distance along the ray through each pixel's centre.

    Infinite beside the object. For many cameras, make one `Studio(seed, lights=1)` and ask it.
    """
    return Studio(seed, lights=1).depth(camera)
