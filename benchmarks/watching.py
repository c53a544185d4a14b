"""Held-out PSNR while `reconstruct` trains, without counting the time that measuring takes.

The trainer's own previews are what is measured: whatever a stage can show of itself, at the photos' full size and from
several held-out views. So early points are of the continuous field, later ones of the texels as they would be shipped.
"""

import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

import core.baking.preview as preview_module
import core.reconstruct as reconstruct_module
from benchmarks.child_process import gpu_memory_bytes
from benchmarks.patching import replaced
from core.capture import View
from core.metrics import psnr

FIRST_S = 2.0
GROWTH = 1.25  # from one moment to the next
FULL_SIZE_PX = 1 << 20


@dataclass(frozen=True)
class CurvePoint:
    """Attributes: seconds: of training so far. psnr: dB, mean over the watched views. stage: that was under way."""

    seconds: float
    psnr: float
    stage: str


class Watch:
    """Attributes:
    points: what was measured.
    paused_s: what measuring took, to be taken off the trainer's own seconds.
    gpu_bytes: the most that was seen in use of the GPU's memory.
    """

    def __init__(self, views: Sequence[View], device: str = "cpu") -> None:
        self.views, self.device = tuple(views), device
        self.points: list[CurvePoint] = []
        self.paused_s, self.gpu_bytes = 0.0, 0
        self._started, self._due = time.monotonic(), FIRST_S

    @property
    def trained_s(self) -> float:
        return time.monotonic() - self._started - self.paused_s

    @contextmanager
    def attached(self) -> Iterator["Watch"]:
        """Watches the `reconstruct` that is called within."""
        show = reconstruct_module._Run._preview

        def watching(run: Any, stage: Any) -> None:
            if self.trained_s >= self._due:
                self._measure(lambda: show(run, stage), run, stage.name)

        with (
            replaced(reconstruct_module._Run, "_preview", watching),
            replaced(reconstruct_module, "PREVIEW_INTERVAL_S", 0.0),
            replaced(preview_module, "PREVIEW_SIZE_PX", FULL_SIZE_PX),
        ):
            self._started = time.monotonic()
            yield self

    def _measure(self, show: Any, run: Any, stage: str) -> None:
        seconds, started = self.trained_s, time.monotonic()
        capture, scores = run.capture, []
        try:
            for view in self.views:
                run.capture = replace(capture, test=(view,))
                if (picture := show()) is not None:
                    scores.append(psnr(view.over(capture.background), picture / 255.0, view.ignored))
        finally:
            run.capture = capture
        if scores:
            self.points.append(CurvePoint(seconds, float(np.mean(scores)), stage))
        self.gpu_bytes = max(self.gpu_bytes, gpu_memory_bytes(self.device))
        self.paused_s += time.monotonic() - started
        self._due = max(seconds * GROWTH, FIRST_S)
