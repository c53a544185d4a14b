"""The chart of quality against time."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from benchmarks.watching import CurvePoint

SIZE_INCHES, DPI = (8.0, 4.5), 120
COLORS = ("#1b9e77", "#d95f02", "#7570b3", "#e7298a", "#66a61e", "#e6ab02", "#666666")


@dataclass(frozen=True)
class Curve:
    """Attributes:
    label: for the legend.
    points: while training, in order of time.
    end: (seconds of the whole training, PSNR of the re-read .glb), drawn as a dot; None where there is no asset.
    """

    label: str
    points: Sequence[CurvePoint]
    end: tuple[float, float] | None


def draw_chart(path: Path, title: str, curves: Sequence[Curve]) -> None:
    """A PNG: seconds (logarithmic) across, dB upwards; dots are assets as shipped."""
    from matplotlib.figure import Figure  # only here: the figures themselves need no charts

    picture = Figure(SIZE_INCHES, DPI, layout="constrained")
    axes = picture.subplots()
    for curve, color in zip(curves, COLORS * (1 + len(curves) // len(COLORS)), strict=False):
        seconds, psnr = [point.seconds for point in curve.points], [point.psnr for point in curve.points]
        if curve.end:
            axes.plot(*curve.end, "o", color=color)
            seconds, psnr = [*seconds, curve.end[0]], [*psnr, curve.end[1]]
        axes.plot(seconds, psnr, "-", color=color, label=curve.label, linewidth=1.5)
    axes.set_xscale("log")
    axes.xaxis.set_major_formatter("{x:g}")
    axes.set(title=title, xlabel="seconds of training", ylabel="held-out PSNR, dB")
    axes.grid(alpha=0.3, which="both", linewidth=0.5)
    axes.legend(loc="lower right")
    picture.savefig(path)
