"""Where a conversion stands, over all its stages."""

import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace

import numpy as np

from core.progress import Progress, ProgressCallback

# The share of the whole that each stage takes, from its start to its end; training is nearly all of it.
READ = (0.0, 0.02)
TRAIN = (0.02, 0.95)
EXPORT = (0.95, 0.97)
MEASURE = (0.97, 1.0)
# Estimating the cameras of photos without poses comes before all that, and takes about this share of everything.
POSING_SHARE = 0.25
# Each format beside scene.glb comes after all that, and takes about this share of everything.
FORMAT_SHARE = 0.03
# Where nothing else is done, reading the scene and the photos takes this share.
EXPORT_ONLY_READ = 0.1


class Stages:
    """Times the stages and turns their own fractions into those of the whole, which never fall.

    Args:
        callback: is told.
        formats: how many are exported in the end, beside scene.glb.
        only: nothing but formats is.

    Attributes:
        seconds: of each stage that has ended, wall clock.
    """

    def __init__(self, callback: ProgressCallback, formats: int = 0, *, only: bool = False) -> None:
        self._callback = callback
        self._formats = formats
        self._end = EXPORT_ONLY_READ if only else 1.0 - FORMAT_SHARE * formats  # where the formats start
        self._fraction = 0.0
        self._start = 0.0  # where reading starts
        self._psnr: float | None = None
        self._stage = "read"
        self.seconds: dict[str, float] = {}

    @contextmanager
    def stage(self, name: str, span: tuple[float, float]) -> Iterator[None]:
        """Reports the stage's start, and times it."""
        self.report(name, span[0])
        started = time.perf_counter()
        yield
        self.seconds[name] = self.seconds.get(name, 0.0) + time.perf_counter() - started

    def add(self, seconds: Mapping[str, float]) -> None:
        """Takes over what a part timed itself."""
        self.seconds |= seconds

    def posing(self) -> ProgressCallback:
        """A callback for the estimation of cameras; all other stages come after it from now on."""
        self._start = POSING_SHARE
        return lambda report: self._send(replace(report, fraction=POSING_SHARE * report.fraction))

    def within(self, span: tuple[float, float]) -> ProgressCallback:
        """A callback for a part of the work that reports its own fraction, 0 to 1."""

        def inner(report: Progress) -> None:
            self._send(replace(report, fraction=self._of_whole(span[0] + (span[1] - span[0]) * report.fraction)))

        return inner

    def within_format(self, index: int) -> ProgressCallback:
        """A callback for one of the formats, which reports its own fraction, 0 to 1."""

        def inner(report: Progress) -> None:
            done = (index + report.fraction) / self._formats
            self._send(replace(report, fraction=self._end + (1.0 - self._end) * done))

        return inner

    def report(
        self, stage: str, fraction: float, *, psnr: float | None = None, preview_u8: np.ndarray | None = None
    ) -> None:
        """Reports a fraction of all stages from reading to measuring."""
        self._send(Progress(stage, self._of_whole(fraction), psnr, preview_u8))

    def done(self, *, psnr: float | None = None) -> None:
        """Reports the end, of whatever stage came last."""
        self._send(Progress(self._stage, 1.0, psnr))

    def _of_whole(self, fraction: float) -> float:
        return self._start + (self._end - self._start) * fraction

    def _send(self, report: Progress) -> None:
        self._fraction = min(1.0, max(self._fraction, report.fraction))
        self._stage = report.stage
        self._psnr = report.psnr if report.psnr is not None else self._psnr
        self._callback(replace(report, fraction=self._fraction, psnr=self._psnr))
