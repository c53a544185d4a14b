"""What is swept away, and what is not."""

import os
import time
from pathlib import Path

import pytest

from service.job_folder import JobFolder
from service.retention import DAY_S, ORPHAN_AGE_S, UPLOAD_TIMEOUT_S, expired, sweep
from service.settings import ServiceSettings

JOB = "0" * 32


@pytest.fixture
def settings(tmp_path: Path) -> ServiceSettings:
    settings = ServiceSettings(data=tmp_path)
    for folder in (settings.jobs, settings.incoming):
        folder.mkdir()
    return settings


@pytest.fixture
def job(settings: ServiceSettings) -> JobFolder:
    folder = JobFolder(settings.jobs / JOB)
    for path in (folder.capture, folder.checkpoint, folder.artifacts):
        path.mkdir(parents=True)
    return folder


def left(job: JobFolder) -> set[str]:
    return {path.name for path in job.path.iterdir() if path.is_dir()} if job.path.exists() else set()


def age(path: Path, seconds: float) -> None:
    then = time.time() - seconds
    os.utime(path, (then, then))


@pytest.mark.parametrize(
    ("state", "kept"),
    [
        ("PENDING", {"capture", "checkpoint", "artifacts"}),
        ("ENQUEUED", {"capture", "checkpoint", "artifacts"}),
        ("SUCCESS", {"capture", "artifacts"}),
        ("ERROR", {"capture", "artifacts"}),
        ("CANCELLED", {"artifacts"}),
    ],
)
def test_ended_jobs_lose_what_is_of_no_use(
    settings: ServiceSettings, job: JobFolder, state: str, kept: set[str]
) -> None:
    sweep(settings, {JOB: state})
    assert left(job) == kept


def test_job_in_work_is_left_alone(settings: ServiceSettings, job: JobFolder) -> None:
    with job.lock():
        sweep(settings, {JOB: "CANCELLED"})
    assert left(job) == {"capture", "checkpoint", "artifacts"}


def test_folder_without_a_record_goes_once_it_is_old(settings: ServiceSettings, job: JobFolder) -> None:
    sweep(settings, {})
    assert job.path.exists()
    with job.lock():
        pass
    age(job.path, ORPHAN_AGE_S + 60)
    sweep(settings, {})
    assert not job.path.exists()


def test_only_old_uploads_go(settings: ServiceSettings) -> None:
    for name in ("old", "new"):
        (settings.incoming / name).mkdir()
    age(settings.incoming / "old", UPLOAD_TIMEOUT_S + 60)
    sweep(settings, {})
    assert [path.name for path in settings.incoming.iterdir()] == ["new"]


def test_jobs_expire_a_number_of_days_after_their_end() -> None:
    now_s = 1e9
    ended = {"old": int((now_s - 8 * DAY_S) * 1e3), "new": int((now_s - 6 * DAY_S) * 1e3), "running": None}
    assert expired(ended, 7, now_s) == ["old"]
    assert expired(ended, None, now_s) == []
