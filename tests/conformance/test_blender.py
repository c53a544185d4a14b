"""Blender imports the files upright, at scale and textured, and renders the fallback.

Optional: Blender is a gigabyte, and needs an older NumPy. `POLYFIELD_BPY_PYTHON` names a Python that has `bpy`, e.g.
after `python -m venv blender && blender/bin/pip install bpy==4.5.15`.
"""

import json
import os
import subprocess
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from core.baked import BakedScene
from core.conventions import ASSET_FROM_Z_UP
from core.render.reference import visibility
from exporters.gltf import write_glb
from exporters.usd import write_usd
from exporters.usd.quicklook import write_quicklook

PYTHON = os.environ.get("POLYFIELD_BPY_PYTHON", "")
SCRIPT = Path(__file__).with_name("blender_import.py")
SCALE = 2.5
WRITERS: dict[str, Callable[[BakedScene], dict[str, bytes]]] = {
    "scene.glb": write_glb,
    "scene.usdc": write_usd,
    "scene.usdz": lambda scene: write_usd(scene, "usdz"),
    "scene.quicklook.usdz": write_quicklook,
}

pytestmark = pytest.mark.skipif(not PYTHON, reason="POLYFIELD_BPY_PYTHON names no Python with Blender's bpy")


@pytest.fixture
def placed(scene: BakedScene) -> BakedScene:
    """The scene in an asset 2.5 times as large."""
    return replace(scene, asset_from_object=np.diag([SCALE, SCALE, SCALE, 1.0]) @ ASSET_FROM_Z_UP)


def imported(scene: BakedScene, name: str, folder: Path) -> dict[str, Any]:
    for file, data in WRITERS[name](scene).items():
        (folder / file).write_bytes(data)
    size = map(str, scene.cameras[0].size_px)
    command = [PYTHON, str(SCRIPT), str(folder / name), str(folder / "picture.png"), *size]
    run = subprocess.run(command, capture_output=True, text=True, timeout=300, check=True)
    (line,) = [line for line in run.stdout.splitlines() if line.startswith("REPORT ")]
    report: dict[str, Any] = json.loads(line.removeprefix("REPORT "))
    return report


@pytest.mark.parametrize("name", WRITERS)
def test_blender_has_it_upright_at_scale_and_textured(placed: BakedScene, tmp_path: Path, name: str) -> None:
    report = imported(placed, name, tmp_path)
    low, high = (SCALE * corner for corner in placed.bounds())
    if name == "scene.quicklook.usdz":  # stands on the floor
        middle = (low + high) / 2
        shift = np.array([middle[0], middle[1], low[2]])
        low, high = low - shift, high - shift
    np.testing.assert_allclose(report["bounds"], [low, high], atol=1e-5)  # float32
    assert report["textures"]
    assert all(report["textures"].values())


@pytest.mark.parametrize("name", ["scene.glb", "scene.usdz"])
def test_blender_shows_the_mean_colours(placed: BakedScene, tmp_path: Path, name: str) -> None:
    report = imported(placed, name, tmp_path)
    assert report["cameras"] == len(placed.cameras)
    rendered = np.array(Image.open(tmp_path / "picture.png").convert("RGBA")) / 255
    difference = _over_grey(rendered) - _over_grey(_mean_colors(placed))
    # Cycles filters textures and edges, the expectation does not. An object that is misplaced or lit has some 10 dB.
    assert -10 * np.log10((difference**2).mean()) > 20


def _mean_colors(scene: BakedScene) -> np.ndarray:
    """[h, w, 4]: what a fallback shows from the first camera."""
    seen = visibility(scene, scene.cameras[0])
    shown = np.zeros((*seen.hit.shape, 4))
    for index, page in enumerate(scene.pages):
        here = seen.hit & (seen.page == index)
        shown[here, :3] = page.colors_u8[seen.row[here], seen.column[here]] / 255
    shown[..., 3] = seen.hit
    return shown


def _over_grey(rgba: np.ndarray) -> np.ndarray:
    return rgba[..., :3] * rgba[..., 3:] + 0.5 * (1 - rgba[..., 3:])
