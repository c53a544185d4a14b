"""Pixels less what their neighbours predict (RFC 9649, section 4.1)."""

import numpy as np

BLACK, LEFT, TOP, MEAN_OF_TWO, MEAN_OF_FOUR = 0, 1, 2, 7, 10  # of VP8L's fourteen modes those that noisy texels choose
MODES = (LEFT, TOP, MEAN_OF_TWO, MEAN_OF_FOUR, BLACK)
_BLACK = np.array([0, 0, 0, 255], np.uint8)  # the first pixel's prediction, too


def residuals(rows: np.ndarray, above: np.ndarray | None, mode: int) -> np.ndarray:
    """uint8 [h, w, 4] pixels less their prediction, modulo 256.

    Args:
        rows: uint8 [h, w, 4].
        above: [w, 4] the row before them; None: they begin with the image's first.
        mode: of MODES.
    """
    result = np.empty_like(rows)
    if above is None:
        result[0, 0] = rows[0, 0] - _BLACK
        result[0, 1:] = rows[0, 1:] - rows[0, :-1]
        above, rows, rest = rows[0], rows[1:], result[1:]
    else:
        rest = result
    if len(rows):
        upper = np.concatenate([above[None], rows[:-1]])
        rest[:, 0] = rows[:, 0] - upper[:, 0]
        rest[:, 1:] = rows[:, 1:] - _predicted(rows, upper, mode)
    return result


def _predicted(rows: np.ndarray, upper: np.ndarray, mode: int) -> np.ndarray:
    """[h, w - 1, 4], or [4], for all but the first column, from rows and those above each."""
    left, top = rows[:, :-1], upper[:, 1:]
    if mode == BLACK:
        return _BLACK
    if mode == LEFT:
        return left
    if mode == TOP:
        return top
    if mode == MEAN_OF_TWO:
        return _mean(left, top)
    top_right = np.concatenate([upper[:, 2:], rows[:, :1]], 1)  # beyond the last column memory has the row's first
    return _mean(_mean(left, upper[:, :-1]), _mean(top, top_right[:, : top.shape[1]]))


def _mean(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """(a + b) // 2 of bytes, without leaving bytes."""
    mean: np.ndarray = (a & b) + ((a ^ b) >> 1)
    return mean
