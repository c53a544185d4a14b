"""The chart of quality against time: dashed while opacity is continuous, solid once it is binary, a dot as shipped."""

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


BINARY_STAGES = ("texels", "stage 2")
TICKS = [digit * 10.0**power for power in range(-1, 6) for digit in (1, 2, 5)]


def draw_chart(path: Path, title: str, curves: Sequence[Curve]) -> None:
    """A PNG: seconds (logarithmic) across, dB upwards."""
    from matplotlib.figure import Figure  # only here: the figures themselves need no charts

    picture = Figure(SIZE_INCHES, DPI, layout="constrained")
    axes = picture.subplots()
    for curve, color in zip(curves, COLORS * (1 + len(curves) // len(COLORS)), strict=False):
        x, y = [point.seconds for point in curve.points], [point.psnr for point in curve.points]
        if curve.end:
            x, y = [*x, curve.end[0]], [*y, curve.end[1]]
            axes.plot(*curve.end, "o", color=color)
        binary = sum(point.stage not in BINARY_STAGES for point in curve.points)
        axes.plot(x[: binary + 1], y[: binary + 1], "--", color=color, linewidth=1.2)
        axes.plot(x[binary:], y[binary:], "-", color=color, linewidth=1.6, label=curve.label)
    axes.set_xscale("log")
    low, high = axes.get_xlim()
    ticks = [tick for tick in TICKS if low <= tick <= high]
    axes.set_xticks(ticks, [f"{tick:g}" for tick in ticks])
    axes.set_xticks([], minor=True)
    axes.set(title=title, xlabel="seconds of training", ylabel="held-out PSNR, dB")
    axes.grid(alpha=0.3, linewidth=0.5)
    axes.legend(loc="lower right")
    picture.savefig(path)
