"""Trainings that take a second: what the benchmarks' own tests run."""

from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from core import reconstruct as module
from core.presets import settings_for
from core.training import surfacing

HASTY = settings_for(
    "draft", cells=16, patch=3, nodes=20, voxel_steps=30, field_steps=15, texel_steps=15,
    voxel_batch=512, field_batch=512, texel_batch=256,
)  # fmt: skip


@contextmanager
def small_survey() -> Iterator[None]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(surfacing, "SURVEY_RAYS", 32_768)
        patch.setattr(module, "REPORT_INTERVAL_S", 0.0)  # reports of every step
        yield
