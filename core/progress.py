"""How long work tells where it stands."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Progress:
    """One report.

    Attributes:
        stage: read, voxels, field, texels, bake, export or measure.
        fraction: of the whole conversion, 0 to 1, never falling.
        psnr: of recent training pixels, dB; None while unknown.
        preview_u8: a render [height, width, 3] uint8 of what there is so far, only now and then.
    """

    stage: str
    fraction: float
    psnr: float | None = None
    preview_u8: np.ndarray | None = None


ProgressCallback = Callable[[Progress], None]


def ignore_progress(report: Progress) -> None:
    """The callback for callers who do not listen."""
