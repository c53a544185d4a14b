"""How well an asset's surfaces lie where the true ones are."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from benchmarks.fragments import Fragments

FAR_OFF = 0.02  # of the scene's size
EDGE_PX = 1  # pixels so near to the true outline do not count as floaters or holes


@dataclass(frozen=True)
class DepthScores:
    """Over all pixels of some views.

    Attributes:
        median, most: median and 90 % quantile of the depth error, in shares of the scene's size, where both the asset
            and the truth have a surface.
        far_off: share of those pixels whose error is above 2 % of the scene's size.
        floaters: share of covered pixels where in truth there is nothing.
        holes: share of the truth's pixels that are not covered.
        overdraw: opaque fragments per covered pixel; 1 is best.
        fragments: all fragments per covered pixel, holes included: what a GPU draws.
    """

    median: float
    most: float
    far_off: float
    floaters: float
    holes: float
    overdraw: float
    fragments: float


def depth_scores(drawn: Sequence[Fragments], truths: Sequence[np.ndarray], size: float) -> DepthScores:
    """Scores of views.

    Args:
        truths: [height, width] true distance along the ray, infinite where there is nothing; object units.
        size: of the scene, object units.
    """
    fronts = [fragments.front() for fragments in drawn]
    errors = np.concatenate([depth_error(front, truth)[np.isfinite(front) & np.isfinite(truth)] / size
                             for front, truth in zip(fronts, truths, strict=True)])  # fmt: skip
    covered = sum(int(np.isfinite(front).sum()) for front in fronts)
    there = sum(int(np.isfinite(truth).sum()) for truth in truths)
    pairs = list(zip(fronts, truths, strict=True))
    floating = sum(int((np.isfinite(front) & ~_grown(np.isfinite(truth))).sum()) for front, truth in pairs)
    missing = sum(int((~np.isfinite(front) & ~_grown(~np.isfinite(truth))).sum()) for front, truth in pairs)
    layers, total = (sum(int(getattr(f, name)()[np.isfinite(front)].sum()) for f, front in
                         zip(drawn, fronts, strict=True)) for name in ("layers", "drawn"))  # fmt: skip
    quantiles = np.quantile(errors, [0.5, 0.9]) if len(errors) else [np.nan, np.nan]
    return DepthScores(
        median=float(quantiles[0]),
        most=float(quantiles[1]),
        far_off=float((errors > FAR_OFF).mean()) if len(errors) else float("nan"),
        floaters=floating / max(covered, 1),
        holes=missing / max(there, 1),
        overdraw=layers / max(covered, 1),
        fragments=total / max(covered, 1),
    )


def depth_error(front: np.ndarray, truth: np.ndarray) -> np.ndarray:
    """Distance between two depths; NaN or infinite where either has no surface."""
    with np.errstate(invalid="ignore"):
        return np.abs(front - truth)


def _grown(mask: np.ndarray) -> np.ndarray:
    """True within EDGE_PX of a true pixel."""
    padded = np.pad(mask, EDGE_PX)
    shape = mask.shape
    offsets = range(2 * EDGE_PX + 1)
    return np.any([padded[y : y + shape[0], x : x + shape[1]] for y in offsets for x in offsets], 0)
