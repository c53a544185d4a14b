"""Codecs and array arithmetic at work on every usable core: they work outside Python's lock."""

import os
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from contextlib import AbstractContextManager
from typing import TypeVar

from threadpoolctl import threadpool_limits

T = TypeVar("T")
R = TypeVar("R")


def mapped(function: Callable[[T], R], items: Iterable[T]) -> list[R]:
    """`function` of each item, in order, on as many threads as there are cores: more would only take memory.

    Matrix products take one thread each meanwhile.
    """
    with products_on_one_thread(), ThreadPoolExecutor(len(os.sched_getaffinity(0))) as pool:
        return list(pool.map(function, items))


def products_on_one_thread() -> AbstractContextManager[object]:
    """Within it, each of NumPy's matrix products takes one thread.

    Its threads, made for large matrices, wait for each other at full load: many middling products on two cores take
    ten times the work, and each other's cores.
    """
    return threadpool_limits(1, "blas")
