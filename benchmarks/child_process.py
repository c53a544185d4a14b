"""Measurements in processes of their own, so that none leaves memory, threads or compiled kernels to the next."""

import multiprocessing
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any, TypeVar

Result = TypeVar("Result")
KIB = 1024


def in_child(function: Callable[..., Result], *arguments: Any) -> Result:
    """`function(*arguments)` in a fresh Python process; both ways are pickled. Its exceptions are raised here."""
    with ProcessPoolExecutor(1, mp_context=multiprocessing.get_context("spawn")) as pool:
        return pool.submit(function, *arguments).result()


def peak_memory_bytes() -> int:
    """The most that this process has held in memory. (`getrusage` would count what its parent held before, too.)"""
    lines = Path("/proc/self/status").read_text(encoding="ascii").splitlines()
    return next(int(line.split()[1]) * KIB for line in lines if line.startswith("VmHWM:"))


def gpu_memory_bytes(device: str) -> int:
    """What is taken of a GPU's memory now, by anyone; 0 for the CPU."""
    if not device.startswith("cuda"):
        return 0
    import torch

    free, total = torch.cuda.mem_get_info(device)
    return total - free
