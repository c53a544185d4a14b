"""What can be said of a capture before it is trained: photos, cameras, coverage, and what training will take."""

from __future__ import annotations

from core.capture_report.photo_sheet import photos_picture
from core.capture_report.picture import coverage_picture
from core.capture_report.report import CaptureReport, Line, report_of_capture, report_of_unposed

__all__ = [
    "CaptureReport",
    "Line",
    "coverage_picture",
    "photos_picture",
    "report_of_capture",
    "report_of_unposed",
]
