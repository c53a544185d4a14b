"""Launching Warp kernels the same way on CPU and CUDA.

A Warp launch on the CPU runs on one thread but releases the GIL, so a launch is cut into index ranges that a small pool
of Python threads works through. On CUDA it is one launch.

A kernel's first argument is `first: int`; its index is `i = first + wp.tid()`. On the CPU `wp.atomic_add` is a plain
`+=`: ranges that add into shared memory need an accumulator each. Then pass `parts` (how many) and a function
`part -> inputs`; the ranges depend on `count` and `parts` alone, never on the number of threads, so that sums come out
the same on every machine.
"""

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise
from typing import Any

import warp as wp

MAX_THREADS = 8
RANGES_PER_THREAD = 4  # rays differ in cost: smaller ranges even the threads out
CPU_ACCUMULATORS = 2

THREADS = min(len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1, MAX_THREADS)
_POOL = ThreadPoolExecutor(THREADS, thread_name_prefix="kernel")

Inputs = Sequence[Any] | Callable[[int], Sequence[Any]]


def accumulator_parts(device: str) -> int:
    """How many accumulators a kernel that adds up needs on this device: the `parts` to launch it with."""
    return CPU_ACCUMULATORS if device == "cpu" else 1


def launch(kernel: wp.Kernel, count: int, inputs: Inputs, device: str, parts: int | None = None) -> None:
    """Runs `kernel(first, *inputs)` over the indices 0..count-1; on the CPU it has finished when this returns.

    Args:
        inputs: the arguments after `first`, or a function from the part (0..parts-1) to them.
        parts: number of ranges. None: as many as suit the machine, for kernels whose indices do not share memory
            (then `inputs` must be a sequence).
    """
    if count <= 0:
        return
    ranges = _ranges(count, parts or (1 if device != "cpu" else THREADS * RANGES_PER_THREAD))

    def run(part: int) -> None:
        first, stop = ranges[part]
        arguments = inputs(part) if callable(inputs) else inputs
        wp.launch(kernel, dim=stop - first, inputs=[first, *arguments], device=device)

    if device != "cpu" or len(ranges) == 1:
        for part in range(len(ranges)):
            run(part)
        return
    kernel.module.load(wp.get_device("cpu"), 1)  # compiled once, before the threads meet
    list(_POOL.map(run, range(len(ranges))))


def _ranges(count: int, parts: int) -> list[tuple[int, int]]:
    """[first, stop) of at most `parts` ranges of nearly equal length that cover 0..count-1, none empty."""
    parts = min(parts, count)
    edges = [count * part // parts for part in range(parts + 1)]
    return list(pairwise(edges))
