"""Makes deliverables, one after the other: only one is in memory at a time."""

import logging
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

from core.errors import PolyfieldError
from core.progress import Progress, ProgressCallback, ignore_progress
from service.atomic import write_atomically
from service.formats.measure import Measure
from service.formats.registry import FORMATS, Format
from service.formats.row import FormatRow
from service.formats.source import Source

NO_VIEWS = "not measured: no held-out view"
STAGE = "export "  # before the format's name
WRITING = 0.5  # the share of a format's time before it is measured
Within = Callable[[str], ProgressCallback]

log = logging.getLogger(__name__)


def exported(
    source: Source,
    names: Sequence[str],
    folder: Path,
    measure: Measure | None,
    within: Within = lambda name: ignore_progress,
) -> Iterator[tuple[str, FormatRow]]:
    """Writes each format into `folder`, reads it again and measures it; yields (name, row) as they are done.

    A file appears whole, and only if it can be read again. One that cannot be made is a row with a problem, and an
    older one of its name is removed: it would pass for the new one.

    Args:
        source: what to export.
        names: of FORMATS.
        folder: exists.
        measure: None where there are no views to measure on.
        within: gives the callback for the progress of one format, which reports 0 to 1 of itself.
    """
    for name in names:
        form, started = FORMATS[name], time.perf_counter()
        path = folder / form.file
        try:
            size, psnr = _exported(form, source, path, measure, within(name))
        except Exception as error:  # whatever it is, the other formats are not to be lost
            log.exception("format %s", name)
            if not source.is_file(path):
                path.unlink(missing_ok=True)
            yield name, FormatRow(form.file, None, None, time.perf_counter() - started, problem=_problem(error))
        else:
            note = "" if measure else NO_VIEWS
            yield name, FormatRow(form.file, size, psnr, time.perf_counter() - started, note=note)


def _exported(
    form: Format, source: Source, path: Path, measure: Measure | None, progress: ProgressCallback
) -> tuple[int, float | None]:
    """(bytes, PSNR)."""

    def measuring(report: Progress) -> None:
        progress(Progress(STAGE + form.name, WRITING + (1.0 - WRITING) * report.fraction))

    progress(Progress(STAGE + form.name, 0.0))
    is_there = source.is_file(path)
    data = path.read_bytes() if is_there else form.write(source)
    held = form.read(data)
    psnr = measure.psnr(held, source.scene, measuring) if measure else None
    if not is_there:
        write_atomically(path, data)
    progress(Progress(STAGE + form.name, 1.0))
    return len(data), psnr


def _problem(error: Exception) -> str:
    if isinstance(error, PolyfieldError):
        return f"{error.code}: {error}"
    return f"internal: something went wrong inside Polyfield ({type(error).__name__}); the log says what"
