"""Fixtures of the unit tests."""

from collections.abc import Iterator

import pytest
import torch

from core.device import usable_gpus

NO_GPU = pytest.mark.skipif(usable_gpus() == 0, reason="no GPU that Warp and PyTorch can use")


@pytest.fixture(params=["cpu", pytest.param("cuda:0", marks=NO_GPU)])
def device(request):
    """Every device that kernels run on."""
    return request.param


@pytest.fixture(autouse=True, scope="session")
def one_torch_thread() -> Iterator[None]:
    """As while training: torch's threads and the kernels' would spin against one another."""
    threads = torch.get_num_threads()
    torch.set_num_threads(1)
    yield
    torch.set_num_threads(threads)
