"""Codecs and array arithmetic at work on every usable core: they work outside Python's lock."""

import os
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

from threadpoolctl import threadpool_limits

T = TypeVar("T")
R = TypeVar("R")


def mapped(function: Callable[[T], R], items: Iterable[T]) -> list[R]:
    """`function` of each item, in order, on as many threads as there are cores: more would only take memory.

    Matrix products take one thread each meanwhile: NumPy's, made for large matrices, would wait for each other.
    """
    with threadpool_limits(1, "blas"), ThreadPoolExecutor(len(os.sched_getaffinity(0))) as pool:
        return list(pool.map(function, items))
