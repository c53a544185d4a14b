"""Which device the work runs on."""

import re
from collections.abc import Iterator
from contextlib import contextmanager

from core.errors import OptionInvalid

AUTO = "auto"
CPU = "cpu"


def resolve_device(name: str = AUTO) -> str:
    """The device meant by `auto`, `cpu`, `cuda` or `cuda:N`: "cpu" or "cuda:N", as Warp and PyTorch both call it.

    Raises:
        OptionInvalid: any other name, or a GPU that Warp or PyTorch cannot use here.
    """
    if name == CPU:
        return CPU
    if name == AUTO:
        return "cuda:0" if usable_gpus() > 0 else CPU
    match = re.fullmatch(r"cuda(?::(\d{1,3}))?", name)
    if match is None:
        raise OptionInvalid(
            "device", "must be auto, cpu, cuda or cuda:N", repr(name), "Leave it out, and the best one is chosen."
        )
    index = int(match.group(1) or 0)
    if index >= usable_gpus():
        raise OptionInvalid(
            "device",
            f"{name} needs an NVIDIA GPU and the CUDA build of PyTorch",
            f"{usable_gpus()} usable GPUs",
            "Use --device cpu, or install the CUDA build.",
        )
    return f"cuda:{index}"


@contextmanager
def torch_threads(count: int) -> Iterator[None]:
    """Within, PyTorch uses so many threads on the CPU; afterwards as many as before."""
    import torch

    before = torch.get_num_threads()
    torch.set_num_threads(count)
    try:
        yield
    finally:
        torch.set_num_threads(before)


def usable_gpus() -> int:
    """How many CUDA devices both Warp (the kernels) and PyTorch (the network) can use."""
    import torch
    import warp

    import core.kernels  # noqa: F401  (starts Warp)

    return min(warp.get_cuda_device_count(), torch.cuda.device_count()) if torch.cuda.is_available() else 0
