"""Where a capture comes from: a folder, a pose file or a zip archive."""

import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from core.errors import CaptureNotFound
from service.archive import extract
from service.settings import Limits


@contextmanager
def opened_capture(path: Path, limits: Limits | None = None) -> Iterator[Path]:
    """Yields a path for `read_capture`. An archive is unpacked to a temporary folder, which is removed again.

    Raises:
        CaptureNotFound, ArchiveInvalid, ArchiveUnsafe, ArchiveTooLarge
    """
    if not path.exists():
        raise CaptureNotFound(str(path), "must be a folder, a pose file or a .zip", "nothing there", "Check the path.")
    if path.is_dir() or path.suffix.lower() != ".zip":
        yield path
        return
    with tempfile.TemporaryDirectory(prefix="polyfield-") as folder:
        extract(path, Path(folder), limits or Limits())
        yield Path(folder)
