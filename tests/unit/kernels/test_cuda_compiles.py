"""The CUDA side of the kernels compiles, also where there is no GPU to run it.

In a process of its own: compiling ahead of time renames the structs that modules share, and launching those modules on
the CPU afterwards crashes (Warp 1.x).
"""

import subprocess
import sys
from pathlib import Path

import pytest

COMPILE = """
import sys
import warp as wp
from pathlib import Path
from core.kernels import adam, camera_rays, fusion, march, silhouettes, smoothness, surfaces, trace

plain = (adam, camera_rays, fusion, march, silhouettes, smoothness, surfaces, trace)
modules = {module.__name__.split(".")[-1]: module for module in plain}
for surface, kernels in (("volume", surfaces.VOLUME_KERNELS), ("texels", surfaces.TEXEL_KERNELS)):
    for step, kernel in zip(("trace", "composite", "backward"), kernels, strict=True):
        modules[f"{surface}-{step}"] = kernel.module
for name in sys.argv[2:]:
    folder = Path(sys.argv[1]) / name
    folder.mkdir()
    wp.compile_aot_module(modules[name], arch=75, module_dir=folder, strip_hash=True)
"""
STEPS = [f"{surface}-{step}" for surface in ("volume", "texels") for step in ("trace", "composite", "backward")]
MODULES = ["adam", "camera_rays", "fusion", "march", "silhouettes", "smoothness", "surfaces", "trace", *STEPS]
ROOT = Path(__file__).parents[3]


@pytest.fixture(scope="module")
def compiled(tmp_path_factory) -> tuple[Path, str]:
    """(folder with a folder for each module, what the compiler said)."""
    folder = tmp_path_factory.mktemp("cuda")
    command = [sys.executable, "-c", COMPILE, str(folder), *MODULES]
    run = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=300, check=False)
    return folder, run.stdout + run.stderr


@pytest.mark.parametrize("name", MODULES)
def test_kernels_compile_for_cuda(compiled, name):
    folder, said = compiled
    assert list((folder / name).glob("*.cubin")), said
