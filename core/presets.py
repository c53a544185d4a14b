"""Settings of a reconstruction, and the presets people choose from.

Every knob is a number, so that the command line and the API can override any of them by name.
"""

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from typing import Any

from core.errors import OptionInvalid, UnknownPreset


@dataclass(frozen=True)
class Settings:
    """What may be traded.

    Attributes:
        preset: the preset these started from.
        cells: P, cells per axis of the mesh grid (paper 3.1). More follow finer shapes and make more quads.
        patch: K, texels per quad side (paper 3.3). Texels of about half a photo's pixel are enough.
        nodes: nodes per axis of the finest voxel grid.
        voxel_steps, field_steps, texel_steps: training steps of the three stages.
        voxel_batch, field_batch, texel_batch: pixels per step.
        distortion: weight of the distortion loss (mip-NeRF 360, eq. 15).
        coverage: weight of the squared error of coverage against the photos' alpha.
    """

    preset: str
    cells: int
    patch: int
    nodes: int
    voxel_steps: int
    field_steps: int
    texel_steps: int
    voxel_batch: int = 8192
    field_batch: int = 8192
    texel_batch: int = 4096
    distortion: float = 0.03
    coverage: float = 0.1

    def __post_init__(self) -> None:
        for name, (low, high) in LIMITS.items():
            value = getattr(self, name)
            if not low <= value <= high:
                raise OptionInvalid(f"option {name}", f"must be between {low} and {high}", str(value))


LIMITS: dict[str, tuple[float, float]] = {
    "cells": (8, 256),
    "patch": (2, 64),
    "nodes": (16, 384),
    "voxel_steps": (1, 10**6),
    "field_steps": (1, 10**6),
    "texel_steps": (1, 10**6),
    "voxel_batch": (64, 2**20),
    "field_batch": (64, 2**20),
    "texel_batch": (64, 2**18),
    "distortion": (0.0, 100.0),
    "coverage": (0.0, 100.0),
}

PRESETS: dict[str, Settings] = {
    "draft": Settings("draft", cells=64, patch=5, nodes=128, voxel_steps=1000, field_steps=500, texel_steps=700),
    "balanced": Settings(
        "balanced", cells=96, patch=8, nodes=256, voxel_steps=3400, field_steps=2400, texel_steps=2500
    ),
    # Most steps go where cells are fine: into the field stage (docs/training.md).
    "high": Settings("high", cells=128, patch=8, nodes=256, voxel_steps=3800, field_steps=5000, texel_steps=2400),
}


def settings_for(preset: str, **overrides: object) -> Settings:
    """A preset with some knobs set by hand; numbers may be given as text.

    Raises:
        UnknownPreset, OptionInvalid
    """
    if preset not in PRESETS:
        raise UnknownPreset(
            "preset", f"must be one of {', '.join(PRESETS)}", repr(preset), "Leave it out to get 'balanced'."
        )
    return replace(PRESETS[preset], **_numbers(overrides))


def _numbers(overrides: Mapping[str, object]) -> dict[str, Any]:
    kinds = {field.name: field.type for field in fields(Settings) if field.name != "preset"}
    numbers: dict[str, Any] = {}
    for name, value in overrides.items():
        if name not in kinds:
            raise OptionInvalid(f"option {name}", f"must be one of {', '.join(kinds)}", "an unknown name")
        try:
            numbers[name] = int(str(value)) if kinds[name] in (int, "int") else float(str(value))
        except ValueError:
            raise OptionInvalid(f"option {name}", "must be a number", repr(value)) from None
    return numbers
