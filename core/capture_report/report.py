"""The capture report: everything known of a capture before training starts, posed or not."""

from __future__ import annotations

from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from core.capture import Capture, View
from core.capture_report.coverage import Coverage, coverage_of
from core.capture_report.expectation import Expectation
from core.capture_report.photo_quality import SIDE_PX, Look, PhotoQuality, compared, look_of
from core.capture_report.wording import Line, lines_of
from core.errors import InputError
from core.images import read_reduced
from core.posing.posing import LeftOut, Posing

THREADS = 2


@dataclass(frozen=True)
class CaptureReport:
    """Attributes:
    format: the capture's format and convention, as a phrase.
    photos: every photo that is used (of a refused set: every readable one), sorted by name.
    left_out: photos that are not used, and why.
    kind: of scene (object, forward, unbounded), and the reason; None where the cameras are not known.
    frame: `scale` and `centre` of the object frame in the user's units and frame; None as above.
    coverage: None as above.
    expected: what training will take; None as above.
    posing: what estimating the cameras gave (points, error_px, seconds, ...); None where the capture has poses.
    notes: remarks for the user.
    """

    format: str
    photos: tuple[PhotoQuality, ...]
    left_out: tuple[LeftOut, ...] = ()
    kind: Mapping[str, Any] | None = None
    frame: Mapping[str, Any] | None = None
    coverage: Coverage | None = None
    expected: Expectation | None = None
    posing: Mapping[str, Any] | None = None
    notes: tuple[str, ...] = ()

    @property
    def is_usable(self) -> bool:
        """Whether there are cameras to train with."""
        return self.coverage is not None

    def lines(self) -> tuple[Line, ...]:
        """The report as a person reads it, a dozen lines at most."""
        return lines_of(self)

    def as_json(self) -> dict[str, Any]:
        return {**asdict(self), "lines": [asdict(line) for line in self.lines()]}

    def as_table(self) -> str:
        """For a terminal; lines that need attention start with an exclamation mark."""
        return "\n".join(f"{'!' if line.warns else ' '} {line.label:<9} {line.text}" for line in self.lines())


def report_of_capture(
    capture: Capture, form: str, expected: Expectation | None = None, posing: Posing | None = None
) -> CaptureReport:
    """The report of a capture that can be trained.

    Args:
        capture: in the object frame.
        form: its format and convention, as a phrase.
        posing: where its cameras were estimated.
    """
    views = sorted((*capture.train, *capture.test), key=lambda view: view.camera.name)
    held_out = {id(view) for view in capture.test}
    with ThreadPoolExecutor(THREADS) as threads:
        looks = list(threads.map(_look_of_view, views))
    names = [view.camera.name for view in views]
    scale = float(np.cbrt(np.linalg.det(capture.user_from_object[:3, :3])))
    return CaptureReport(
        form,
        compared(names, [id(view) in held_out for view in views], looks),
        posing.left_out if posing else (),
        kind=asdict(capture.kind),
        frame={"scale": scale, "centre": capture.user_from_object[:3, 3].tolist()},
        coverage=coverage_of(views, scale),
        expected=expected,
        posing=_facts(posing),
        notes=capture.notes,
    )


def report_of_unposed(form: str, posing: Posing) -> CaptureReport:
    """The report of photos whose cameras could not be estimated."""
    names = sorted([*posing.registered, *(photo.name for photo in posing.left_out)])
    names = [name for name in names if (posing.images / name).is_file()]
    with ThreadPoolExecutor(THREADS) as threads:
        looks = list(threads.map(lambda name: _look_of_file(posing.images / name), names))
    return CaptureReport(form, compared(names, [False] * len(names), looks), posing.left_out, posing=_facts(posing))


def _look_of_view(view: View) -> Look:
    return look_of(view.image_u8, view.ignored)


def _look_of_file(path: Path) -> Look:
    try:
        return look_of(read_reduced(path, SIDE_PX))
    except InputError:
        return Look(None, None)


def _facts(posing: Posing | None) -> dict[str, Any] | None:
    if posing is None:
        return None
    return {
        "registered": len(posing.registered),
        "photos": len(posing.registered) + len(posing.left_out),
        "cameras": posing.cameras,
        "points": posing.points,
        "error_px": posing.error_px,
        "seconds": dict(posing.seconds),
    }
