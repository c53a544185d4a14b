"""What training will take, roughly: a person wants to know whether to wait or to come back tomorrow.

The constants are fits by eye to the conversions in benchmarks/results (lego at 100 and 400 px, the sample, fern, fox;
two cores of an AMD EPYC). They hold within a factor of two: scenes differ in how much surface they have.
"""

from __future__ import annotations

import os
from dataclasses import dataclass

from core.presets import Settings

# Seconds per ray on two cores, and per node or cell of an axis: finer grids are met more often.
VOXEL_RAY_S, FIELD_RAY_S, TEXEL_RAY_S = 2.3e-8, 1.05e-7, 1.6e-7
SURROUNDINGS = 1.5  # times as long where a scene has some: every ray meets something, often in fog
PIXEL_S = 1.9e-6  # of baking and measuring, per pixel of all photos
START_S = 6.0
MEASURED_CORES = 2
# Quads per P x P, bytes per texel and quad of the .glb.
QUADS_PER_SQUARE = 9.0
TEXEL_BYTES, QUAD_BYTES = 8.0, 100.0
FACTOR = 1.7


@dataclass(frozen=True)
class Expectation:
    """Attributes:
    seconds: of training and measuring; None on devices where it was never measured.
    glb_bytes: of scene.glb.
    factor: both may be so many times smaller or larger.
    """

    seconds: float | None
    glb_bytes: float
    factor: float = FACTOR


def expected(
    settings: Settings,
    photo_pixels: int,
    device: str = "cpu",
    cores: int | None = None,
    *,
    surroundings: bool = False,
) -> Expectation:
    """What a conversion will take.

    Args:
        photo_pixels: of all photos together, as trained on.
        device: as resolved: cpu, cuda or cuda:N.
        cores: of the machine; asked from it by default.
        surroundings: whether the scene has some, that is, whether it is anything but an object.
    """
    quads = QUADS_PER_SQUARE * settings.cells**2
    glb_bytes = quads * (TEXEL_BYTES * settings.patch**2 + QUAD_BYTES)
    if device != "cpu":
        return Expectation(None, glb_bytes)
    rays = (
        settings.voxel_steps * settings.voxel_batch * settings.nodes * VOXEL_RAY_S
        + settings.field_steps * settings.field_batch * settings.cells * FIELD_RAY_S
        + settings.texel_steps * settings.texel_batch * settings.cells * TEXEL_RAY_S
    )
    rays *= SURROUNDINGS if surroundings else 1.0
    cores = cores or os.cpu_count() or MEASURED_CORES
    return Expectation((START_S + rays + photo_pixels * PIXEL_S) * MEASURED_CORES / cores, glb_bytes)
