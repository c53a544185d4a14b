"""What ended jobs, broken uploads and crashes leave on disk."""

import logging
import shutil
import time
from collections.abc import Mapping
from pathlib import Path

from service.job_folder import JOB_ID, JobFolder
from service.settings import ServiceSettings

# An upload of the largest size over a slow line takes hours.
UPLOAD_TIMEOUT_S = 24 * 3600
DAY_S = 24 * 3600
# A folder is there a moment before its row is.
ORPHAN_AGE_S = 600

log = logging.getLogger(__name__)


def sweep(settings: ServiceSettings, states: Mapping[str, str]) -> None:
    """Removes what nobody will come back for.

    Args:
        states: the job engine's state of every job it knows.
    """
    for path in settings.incoming.iterdir():
        if _age_s(path) > UPLOAD_TIMEOUT_S:
            shutil.rmtree(path, ignore_errors=True)
    for path in settings.jobs.iterdir():
        if JOB_ID.fullmatch(path.name):
            _sweep_job(JobFolder(path), states.get(path.name))


def expired(ended_ms: Mapping[str, int | None], keep_days: float | None, now_s: float) -> list[str]:
    """The jobs that ended more than `keep_days` ago.

    Args:
        ended_ms: job to the time it ended, milliseconds since 1970; None while it has not.
        now_s: seconds since 1970.
    """
    if keep_days is None:
        return []
    return [job for job, ended in ended_ms.items() if ended is not None and now_s - ended / 1e3 > keep_days * DAY_S]


def _sweep_job(folder: JobFolder, state: str | None) -> None:
    try:
        with folder.lock():
            if state is None and _age_s(folder.path) > ORPHAN_AGE_S:
                log.info("job %s has no record; its folder is removed", folder.id)
                folder.remove()
            elif state == "CANCELLED":
                folder.drop_inputs()
            elif state in ("SUCCESS", "ERROR", "MAX_RECOVERY_ATTEMPTS_EXCEEDED"):
                folder.drop_checkpoint()
    except (BlockingIOError, FileNotFoundError):
        pass  # in work, or removed meanwhile


def _age_s(path: Path) -> float:
    try:
        return time.time() - path.stat().st_mtime
    except FileNotFoundError:
        return 0.0
