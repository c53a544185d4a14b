"""The CUDA side of the kernels compiles, also where there is no GPU to run it."""

import pytest
import warp as wp

from core.kernels import adam, camera_rays, march, surfaces, trace

UNIQUE = {
    f"{surface} {step}": kernel.module
    for surface, kernels in (("volume", surfaces.VOLUME_KERNELS), ("texels", surfaces.TEXEL_KERNELS))
    for step, kernel in zip(("trace", "composite", "backward"), kernels, strict=True)
}
MODULES = {module.__name__: module for module in (adam, camera_rays, march, surfaces, trace)} | UNIQUE


@pytest.mark.parametrize("name", MODULES)
def test_kernels_compile_for_cuda(tmp_path, name):
    wp.compile_aot_module(MODULES[name], arch=75, module_dir=tmp_path, strip_hash=True)
    assert list(tmp_path.glob("*.cubin"))
