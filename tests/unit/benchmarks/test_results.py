"""The table of measured conversions."""

import json
from dataclasses import replace
from pathlib import Path

import pytest

from benchmarks.results import JSON_FILE, TABLE_FILE, ConvertRow, add_row

ROW = ConvertRow(
    name="lego-draft",
    preset="draft",
    overrides={},
    hardware="some CPU, 2 cores",
    device="cpu",
    views={"train": 100, "test": 25},
    psnr=26.5,
    ssim=0.9,
    glb_bytes=2_500_000,
    quads=9000,
    pages=1,
    seconds={"voxels": 40.0, "bake": 2.0},
    total_s=90.0,
    cpu_s=150.0,
)


def test_measuring_again_replaces_the_row_of_the_same_name_and_hardware(tmp_path: Path) -> None:
    for row in (ROW, replace(ROW, hardware="other CPU, 8 cores"), replace(ROW, psnr=27.0)):
        add_row(tmp_path, row)
    rows = json.loads((tmp_path / JSON_FILE).read_text())
    assert [(row["hardware"], row["psnr"]) for row in rows] == [("other CPU, 8 cores", 26.5), (ROW.hardware, 27.0)]


def test_table_has_every_row_and_all_columns(tmp_path: Path) -> None:
    add_row(tmp_path, ROW)
    add_row(tmp_path, replace(ROW, name="unmeasured", psnr=None, ssim=None))
    lines = [line for line in (tmp_path / TABLE_FILE).read_text().splitlines() if line.startswith("|")]
    assert len(lines) == 4
    assert len({line.count("|") for line in lines}) == 1
    assert "26.50" in lines[2]
    assert "not measured" in lines[3]


@pytest.mark.parametrize(
    ("changes", "met"),
    [
        ({}, True),
        ({"goal_psnr": 26.5, "goal_s": 90.0}, True),
        ({"goal_psnr": 26.6}, False),
        ({"goal_s": 89.0}, False),
        ({"goal_psnr": 20.0, "psnr": None}, False),
    ],
)
def test_goals_are_met_when_quality_and_time_are_within_them(changes: dict, met: bool) -> None:
    assert replace(ROW, **changes).goals_met is met
