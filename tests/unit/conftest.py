"""Fixtures of the unit tests."""

import pytest

from core.device import usable_gpus

NO_GPU = pytest.mark.skipif(usable_gpus() == 0, reason="no GPU that Warp and PyTorch can use")


@pytest.fixture(params=["cpu", pytest.param("cuda:0", marks=NO_GPU)])
def device(request):
    """Every device that kernels run on."""
    return request.param
