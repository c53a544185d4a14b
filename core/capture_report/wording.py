"""The capture report in words: a dozen lines, each with a label, and a mark where something needs attention."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from core.posing.posing import NO_DETAIL
from core.scene_kind import FORWARD, UNBOUNDED

if TYPE_CHECKING:
    from core.capture_report.report import CaptureReport

MAX_NAMED = 4
# Of the directions from above an object should be seen from; less leaves sides that training has to guess.
LEAST_SHARE = 0.5
WIDE_GAP_DEG = 90.0
FEW_PHOTOS = 20
# Above, poses are too coarse for the texels of a photo of this size.
BAD_ERROR_PX = 2.0


@dataclass(frozen=True)
class Line:
    """One line: what it is about, what there is to say, and whether it needs attention."""

    label: str
    text: str
    warns: bool = False


def lines_of(report: CaptureReport) -> tuple[Line, ...]:
    """The lines, in the order in which a person wants them."""
    return tuple(_lines(report))


def _lines(report: CaptureReport) -> Iterator[Line]:
    yield _photos(report)
    yield Line("format", report.format)
    yield from _poses(report)
    yield from _left_out(report)
    yield from _scene(report)
    yield _blur(report)
    yield _exposure(report)
    yield from _expected(report)
    yield from (Line("note", note) for note in report.notes)


def _photos(report: CaptureReport) -> Line:
    count = len(report.photos)
    if not report.is_usable:
        return Line("photos", f"{count}, none of them used", warns=True)
    few = "; 30 to 100 give a good result" if count < FEW_PHOTOS else ""
    held = [photo.name for photo in report.photos if photo.held_out]
    if not held:
        text = f"{count}, all to train on; none is held out, so quality cannot be measured{few}"
        return Line("photos", text, warns=bool(few))
    train = f"{count - len(held)} to train on, {len(held)} held out to measure ({named(held)})"
    return Line("photos", f"{count}: {train}{few}", warns=bool(few))


def _poses(report: CaptureReport) -> Iterator[Line]:
    posing = report.posing
    if posing is None:
        return
    found = f"{posing['registered']} of {posing['photos']} photos posed"
    if not report.is_usable:
        yield Line("poses", f"{found}: too few to go on", warns=True)
        return
    error = posing["error_px"]
    seconds = sum(posing["seconds"].values())
    text = f"{found} in {duration(seconds)}; {posing['points']} points, off by {error:.2f} px on average"
    yield Line("poses", text, warns=error > BAD_ERROR_PX or posing["registered"] < 0.8 * posing["photos"])


def _left_out(report: CaptureReport) -> Iterator[Line]:
    groups: dict[str, list[str]] = {}
    for photo in report.left_out:
        groups.setdefault(photo.reason, []).append(photo.name)
    for reason, names in sorted(groups.items(), key=lambda group: -len(group[1])):
        yield Line("left out", f"{len(names)} {reason}: {named(names)}", warns=True)


def _scene(report: CaptureReport) -> Iterator[Line]:
    if report.kind is None or report.coverage is None or report.frame is None:
        return
    yield Line("scene", f"{report.kind['name']}, because {report.kind['reason']}" if not report.kind["overridden"]
               else f"{report.kind['name']}, as chosen")  # fmt: skip
    centre = ", ".join(f"{value:.4g}" for value in report.frame["centre"])
    yield Line("frame", f"centre at ({centre}), 1 unit of the model is {report.frame['scale']:.4g} of the capture's")
    yield _coverage(report)


def _coverage(report: CaptureReport) -> Line:
    coverage = report.coverage
    assert coverage is not None
    assert report.kind is not None
    if report.kind["name"] == FORWARD:
        width, height = coverage.spread
        return Line(
            "coverage", f"cameras spread over {width:.3g} x {height:.3g}, axes within {coverage.axis_deg:.0f} degrees"
        )
    low, high = coverage.elevation_deg
    gap = coverage.gap_deg
    around = "from all around" if gap < WIDE_GAP_DEG else f"from {360 - gap:.0f} of 360 degrees around"
    if report.kind["name"] == UNBOUNDED:
        return Line("coverage", f"cameras stand {around.replace('from ', '')} what they look at, their axes within "
                    f"{coverage.axis_deg:.0f} degrees of their mean")  # fmt: skip
    share = f"{coverage.upper_share:.0%} of the directions from above"
    text = f"{around}, {low:.0f} to {high:.0f} degrees above the horizon; {share} lie within 20 degrees of a photo"
    return Line("coverage", text, warns=gap >= WIDE_GAP_DEG or coverage.upper_share < LEAST_SHARE)


def _blur(report: CaptureReport) -> Line:
    # What has no detail at all was said to be left out already.
    blurred = [photo for photo in report.photos if photo.blurred and photo.name not in _without_detail(report)]
    if not blurred:
        return Line("blur", "no photo is much less sharp than the others")
    names = [f"{photo.name} ({photo.sharpness:.0%} of the usual sharpness)" for photo in blurred]
    return Line("blur", f"{len(blurred)} blurred: {named(names)}", warns=True)


def _without_detail(report: CaptureReport) -> set[str]:
    return {photo.name for photo in report.left_out if photo.reason == NO_DETAIL}


def _exposure(report: CaptureReport) -> Line:
    jumps = [photo for photo in report.photos if photo.jumps]
    if not jumps:
        return Line("exposure", "no photo is much brighter or darker than the others")
    names = [f"{photo.name} ({photo.exposure_stops:+.1f} stops)" for photo in jumps]
    return Line("exposure", f"{len(jumps)} stand out: {named(names)}", warns=True)


def _expected(report: CaptureReport) -> Iterator[Line]:
    if report.expected is None:
        return
    low, high = report.expected.glb_bytes / report.expected.factor, report.expected.glb_bytes * report.expected.factor
    size = f"{megabytes(low)} to {megabytes(high)} MB"
    if report.expected.seconds is None:
        yield Line("expected", f"a scene.glb of {size}; how long it takes was never measured on this device")
        return
    least, most = (report.expected.seconds * share for share in (1 / report.expected.factor, report.expected.factor))
    yield Line("expected", f"{duration(least)} to {duration(most)} of training, a scene.glb of {size}")


def megabytes(count: float) -> str:
    return f"{count / 1e6:.1f}" if count < 10e6 else f"{count / 1e6:.0f}"


def duration(seconds: float) -> str:
    """As a person says it: 40 s, 12 min, 3.5 h."""
    if seconds < 100:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 6000 else f"{seconds / 3600:.1f} h"


def named(names: Sequence[str]) -> str:
    """Up to four names, and how many more there are."""
    more = len(names) - MAX_NAMED
    return ", ".join(names[:MAX_NAMED]) + (f" and {more} more" if more > 0 else "")
