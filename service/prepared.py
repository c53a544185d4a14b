"""From what the user gave to a capture that can be trained, and its report. Missing cameras are estimated."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from core.capture import Capture
from core.capture_report import (
    CaptureReport,
    coverage_picture,
    photos_picture,
    report_of_capture,
    report_of_unposed,
)
from core.capture_report.convention import ESTIMATED, convention_of
from core.capture_report.expectation import expected
from core.datasets import photos_without_poses, read_capture
from core.posing.pose_photos import pose_photos
from core.posing.posing import Posing
from core.presets import Settings
from core.scene_kind import OBJECT
from service.artifacts import CAPTURE_JSON, CAPTURE_PICTURE
from service.atomic import write_atomically
from service.preview import png_bytes
from service.report import json_bytes
from service.stages import READ, Stages

# Of fewer photos without poses none can be spared to measure on.
HOLD_OUT_FROM = 9
ReportCallback = Callable[[CaptureReport], None]


@dataclass(frozen=True)
class Preparation:
    """How to prepare a capture.

    Attributes:
        settings, device: of the training, which the report foretells.
        seed: of the estimation of cameras.
        photos: what `read_capture` is given.
        out_dir: gets capture.json and capture.png.
        posing_dir: keeps what was estimated of photos without poses.
        on_report: is told the report as soon as it is known.
    """

    settings: Settings
    device: str
    seed: int
    photos: Mapping[str, Any]
    out_dir: Path
    posing_dir: Path
    on_report: ReportCallback

    def prepared(self, source: Path, stages: Stages) -> tuple[Capture, CaptureReport]:
        """The capture at `source`, and its report, written.

        Raises:
            InputError: the capture cannot be used. Of photos that cannot be posed (PosesNotFound) there is a report.
        """
        posing = self._posed(source, stages)
        with stages.stage("read", READ):
            capture = capture_of(source, self.photos, posing)
            form = ESTIMATED if posing else convention_of(source)
            pixels = sum(view.image_u8.shape[0] * view.image_u8.shape[1] for view in capture.train + capture.test)
            expectation = expected(self.settings, pixels, self.device, surroundings=capture.kind.name != OBJECT)
            report = report_of_capture(capture, form, expectation, posing)
            self._publish(report, png_bytes(coverage_picture(capture, report.photos)))
        return capture, report

    def _posed(self, source: Path, stages: Stages) -> Posing | None:
        """Of photos without poses.

        Raises:
            NoImages, TooFewImages, PosesNotFound
        """
        if photos_without_poses(source) is None:
            return None
        posing = pose_photos(source, self.posing_dir, progress=stages.posing(), seed=self.seed)
        stages.add(posing.seconds)
        if not posing.is_usable:
            report = report_of_unposed(ESTIMATED, posing)
            names = [photo.name for photo in report.photos]
            self._publish(report, png_bytes(photos_picture(posing.images, names)))
        posing.require_usable()
        return posing

    def _publish(self, report: CaptureReport, picture: bytes) -> None:
        self.out_dir.mkdir(parents=True, exist_ok=True)
        write_atomically(self.out_dir / CAPTURE_PICTURE, picture)
        write_atomically(self.out_dir / CAPTURE_JSON, json_bytes(report.as_json()))
        self.on_report(report)


def capture_of(source: Path, photos: Mapping[str, Any], posing: Posing | None) -> Capture:
    """The capture at `source`, read as `photos` says; of photos without poses, with the cameras of `posing`.

    Raises:
        InputError
    """
    capture = read_capture(posing.folder if posing else source, **photos)
    return _all_to_train(capture) if posing and len(posing.registered) < HOLD_OUT_FROM else capture


def _all_to_train(capture: Capture) -> Capture:
    views = sorted((*capture.train, *capture.test), key=lambda view: view.camera.name)
    return replace(capture, train=tuple(views), test=())
