"""What is measured on when a scene is exported without being trained."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from core.datasets import photos_without_poses
from core.posing.pose_photos import pose_photos
from core.progress import ProgressCallback
from service.capture_source import opened_capture
from service.formats.measure import Measure
from service.prepared import capture_of


def measure_on(
    capture: Path, photos: Mapping[str, Any], posing_dir: Path, device: str, progress: ProgressCallback
) -> Measure | None:
    """A measure on the capture's held-out views, as a conversion of it would hold them out; None without any.

    Args:
        capture: a folder, a pose file or a .zip.
        photos: what `read_capture` is given; its background is what photos and renders are shown over.
        posing_dir: keeps the cameras of photos without poses.
        progress: is told where the estimation of cameras stands, if there is one.

    Raises:
        InputError: the capture cannot be used.
    """
    with opened_capture(capture) as source:
        posing = None
        if photos_without_poses(source) is not None:
            posing = pose_photos(source, posing_dir, progress=progress)
            posing.require_usable()
        found = capture_of(source, photos, posing)
    return Measure.on(found, found.background, device)
