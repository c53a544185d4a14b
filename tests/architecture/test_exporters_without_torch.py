"""Exporters work on a machine that has neither torch nor Warp."""

import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[2]
PROGRAM = """
import sys

class Blocked:
    def find_spec(self, name, path=None, target=None):
        if name.split(".")[0] in {"torch", "warp", "scipy", "fastapi", "dbos"}:
            raise ImportError(f"{name} is blocked")

sys.meta_path.insert(0, Blocked())
from exporters.check import check_glb
from exporters.gltf import read_glb, read_gltf, read_shaders, write_glb, write_gltf
from exporters.mobilenerf import read_mobilenerf, write_mobilenerf
from exporters.usd import read_usd, write_usd
from tests.scenes import tiny_scene

glb = write_glb(tiny_scene())["scene.glb"]
assert [finding.severity for finding in check_glb(glb)] == ["note"]
assert read_gltf(write_gltf(tiny_scene())).quad_count == read_mobilenerf(write_mobilenerf(tiny_scene())).quad_count
assert read_usd(write_usd(tiny_scene())).quad_count == 48
print(read_glb(glb).quad_count, *sorted(read_shaders(glb)))
"""


def test_writer_and_reader_work_without_torch_and_warp() -> None:
    run = subprocess.run([sys.executable, "-c", PROGRAM], cwd=ROOT, capture_output=True, text=True, timeout=60)
    assert run.returncode == 0, run.stderr
    assert run.stdout.split() == ["48", "essl300", "glsl330"]
