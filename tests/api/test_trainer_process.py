"""How a worker runs a trainer: whatever happens, no process is left and the folder is free again."""

import asyncio
import sys
from pathlib import Path
from typing import Any

import pytest

from service.job_folder import JobFolder
from service.trainer_process import TrainerDied, TrainerHung, run_trainer
from tests.api.running import FAKE_TRAINER, is_alive

pytestmark = pytest.mark.anyio


@pytest.fixture
def folder(tmp_path: Path) -> JobFolder:
    (tmp_path / "artifacts").mkdir()
    return JobFolder(tmp_path)


async def run(folder: JobFolder, act: str, stall_s: float = 30.0) -> tuple[dict[str, Any] | None, list[dict[str, Any]]]:
    """(problem, reports) of the fake trainer."""
    folder.write_request({"name": act})
    reports: list[dict[str, Any]] = []

    async def publish(report: dict[str, Any]) -> None:
        reports.append(report)

    return await run_trainer(FAKE_TRAINER, folder, publish, stall_s), reports


async def test_success_has_no_problem_and_its_last_report_is_published(folder: JobFolder) -> None:
    problem, reports = await run(folder, "quick")
    assert problem is None
    assert reports[-1]["fraction"] == 1.0


async def test_refusal_is_returned(folder: JobFolder) -> None:
    problem, _ = await run(folder, "refuse")
    assert problem is not None
    assert problem["code"] == "capture-empty"


async def test_crash_is_raised(folder: JobFolder) -> None:
    with pytest.raises(TrainerDied):
        await run(folder, "crash")


async def test_silent_trainer_is_killed(folder: JobFolder) -> None:
    with pytest.raises(TrainerHung):
        await run(folder, "hang", stall_s=1.0)
    with folder.lock():
        pass


async def test_cancelled_run_leaves_no_process(folder: JobFolder) -> None:
    task = asyncio.ensure_future(run(folder, "slow"))
    log = folder.path / "starts.log"
    while not (log.exists() and log.read_text().strip()):
        await asyncio.sleep(0.05)
    with pytest.raises(BlockingIOError), folder.lock():
        pass
    task.cancel()
    with pytest.raises(asyncio.CancelledError):
        await task
    assert not is_alive(int(log.read_text().split()[0]))
    with folder.lock():
        pass


async def test_noise_on_stdout_is_ignored(folder: JobFolder) -> None:
    async def publish(report: dict[str, Any]) -> None:
        reports.append(report)

    reports: list[dict[str, Any]] = []
    noisy = (sys.executable, "-c", "print('hello'); print('[1]'); print('{\"report\": {\"fraction\": 1}}')")
    assert await run_trainer(noisy, folder, publish, 30.0) is None
    assert reports == [{"fraction": 1}]
