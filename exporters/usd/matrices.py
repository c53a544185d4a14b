"""4x4 matrices between NumPy, where they act on columns, and USD, where they act on rows."""

import numpy as np
from pxr import Gf


def to_usd(matrix: np.ndarray) -> Gf.Matrix4d:
    """A NumPy [4, 4] for USD, exactly."""
    return Gf.Matrix4d(*np.asarray(matrix, np.float64).T.ravel().tolist())


def from_usd(matrix: Gf.Matrix4d) -> np.ndarray:
    """[4, 4] float64 of a matrix of USD, exactly."""
    return np.array(matrix, np.float64).T.copy()
