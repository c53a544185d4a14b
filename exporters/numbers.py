"""Numbers of glTF's JSON: exact both ways, and refused where they are none."""

from typing import Any

import numpy as np

from exporters.invalid import invalid


def column_major(matrix: np.ndarray) -> list[float]:
    """16 numbers, as glTF writes a 4x4 matrix."""
    return [float(n) for n in np.asarray(matrix, np.float64).T.ravel()]


def matrix_from_column_major(values: Any, subject: str) -> np.ndarray:
    """[4, 4] float64 of 16 numbers."""
    return numbers(values, subject).reshape(4, 4).T.copy()


def numbers(values: Any, subject: str, dtype: type[np.floating[Any]] = np.float64) -> np.ndarray:
    """An array of JSON numbers (never of strings or booleans); too large for `dtype` becomes infinity.

    Raises:
        AssetInvalid: something else than numbers. ValueError: ragged lists.
    """
    array = np.asarray(values)
    if array.dtype.kind not in "iuf":
        raise invalid(subject, "must hold numbers", str(values)[:80])
    with np.errstate(over="ignore"):
        return array.astype(dtype)


def shortest_numbers(values: np.ndarray) -> list[float]:
    """Float32 values as the shortest decimals that read back as the same float32."""
    return [float(str(value)) for value in np.asarray(values, np.float32)]
