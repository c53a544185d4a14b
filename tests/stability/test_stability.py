"""Training stands what captures and machines do to it: `benchmarks.stability`, each conversion a second long.

Rays through vertices and within planes are in tests/unit/kernels; resuming at chosen moments is in tests/unit/training.
"""

from collections.abc import Iterator
from pathlib import Path

import pytest

from benchmarks import stability
from benchmarks.stability import CASES, Lab
from core.training import surfacing

SETTINGS = {
    "cells": 16, "patch": 3, "nodes": 20, "voxel_steps": 40, "field_steps": 20, "texel_steps": 20,
    "voxel_batch": 512, "field_batch": 512, "texel_batch": 256,
}  # fmt: skip
PHOTOS = {"size_px": 32, "train_views": 12, "test_views": 2}


@pytest.fixture(scope="module")
def lab(tmp_path_factory) -> Iterator[Lab]:
    """Converts in this process: what is asked here is not how much memory it takes."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(stability, "in_child", lambda function, *arguments: function(*arguments))
        patch.setattr(surfacing, "SURVEY_RAYS", 32_768)
        yield Lab(tmp_path_factory.mktemp("stability"), SETTINGS, PHOTOS, device="cpu")


def broken(case: str, lab: Lab) -> list[str]:
    """The promises that are not kept."""
    return [f"{check.variant}: {check.found}, not {check.promised}" for check in CASES[case](lab) if not check.kept]


@pytest.mark.parametrize("case", ["frame", "cameras", "colours", "few", "saturation", "rates", "determinism"])
def test_training_stands(lab, case):
    assert broken(case, lab) == []


def test_many_photos_train_at_any_size(lab, monkeypatch):
    """How small photos are read that would not fit is asked in tests/unit/datasets/test_budget.py."""
    monkeypatch.setattr(stability, "MANY", 12)
    monkeypatch.setattr(stability, "LARGE_PX", 64)
    assert broken("memory", lab) == []


@pytest.mark.slow
@pytest.mark.parametrize("case", ["kills"])
def test_killed_processes_go_on(lab, case):
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(stability, "KILLS", 2)
        assert broken(case, lab) == []


def test_a_broken_promise_is_told(lab, tmp_path: Path):
    check = stability.Check("frame", "scaled", "within 0.1 dB", "12.00 dB", False)
    stability.write_results(tmp_path, [check])
    assert "| frame | scaled | within 0.1 dB | 12.00 dB | **no** |" in (tmp_path / "stability.md").read_text()
