"""What training will take, roughly: a person wants to know whether to wait or to come back tomorrow.

The constants are fits by eye to the conversions in benchmarks/results, like those of core/stage_times.py.
"""

from __future__ import annotations

import os
from dataclasses import dataclass

from core.presets import Settings
from core.stage_times import stage_seconds

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
    rays = sum(stage_seconds(settings).values()) * (SURROUNDINGS if surroundings else 1.0)
    cores = cores or os.cpu_count() or MEASURED_CORES
    return Expectation((START_S + rays + photo_pixels * PIXEL_S) * MEASURED_CORES / cores, glb_bytes)
