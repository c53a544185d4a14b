"""Workers die, jobs do not."""

import inspect
import os
import signal
from collections.abc import Iterator
from pathlib import Path

import pytest
from dbos import DBOS

from service.liveness import worker_lock
from service.settings import ServiceSettings
from service.supervisor import Supervisor
from tests.api.running import FAKE_TRAINER, RunningService, Worker, is_alive, wait_until


@pytest.fixture
def service(tmp_path: Path) -> Iterator[RunningService]:
    """A server without a worker."""
    settings = ServiceSettings(
        data=tmp_path / "data", viewer=None, poll_s=0.1, trainer=FAKE_TRAINER, takeover_s=0.2, worker_id="a"
    )
    with RunningService(settings) as service:
        yield service


def starts(service: RunningService, job_id: str) -> list[tuple[int, int]]:
    """(process, count it began with) of each trainer of a job."""
    log = service.settings.jobs / job_id / "starts.log"
    lines = log.read_text().splitlines() if log.exists() else []
    return [(int(pid), int(done)) for pid, done in (line.split() for line in lines)]


def count(service: RunningService, job_id: str) -> int:
    state = service.settings.jobs / job_id / "checkpoint" / "count"
    return int(state.read_text()) if state.exists() else 0


def test_job_of_a_killed_worker_goes_on_from_its_checkpoint_when_the_worker_is_back(service: RunningService) -> None:
    job_id = service.post(name="slow")
    with Worker(service.settings) as worker:
        wait_until(lambda: count(service, job_id) >= 3)
        worker.kill()
    ((pid, _),) = starts(service, job_id)
    wait_until(lambda: not is_alive(pid), 5)  # the trainer dies with its worker
    assert service.job(job_id)["state"] == "running"
    with Worker(service.settings):
        wait_until(lambda: len(starts(service, job_id)) == 2)
        assert starts(service, job_id)[1][1] >= 3
        assert service.client.post(f"/jobs/{job_id}/cancel").json()["state"] == "cancelled"


def test_export_of_a_killed_worker_is_done_when_the_worker_is_back(service: RunningService) -> None:
    with Worker(service.settings) as worker:
        job_id = service.post(name="quick then slow")
        service.wait(job_id)
        assert service.client.post(f"/jobs/{job_id}/exports", json={"formats": ["web"]}).status_code == 202
        wait_until(lambda: len(starts(service, job_id)) == 2)
        worker.kill()
    wait_until(lambda: not is_alive(starts(service, job_id)[1][0]), 5)
    assert service.job(job_id)["export"]["state"] == "running"
    with Worker(service.settings):
        wait_until(lambda: len(starts(service, job_id)) == 3)
        job = service.client.post(f"/jobs/{job_id}/cancel").json()
    assert (job["state"], job["export"]["state"]) == ("succeeded", "cancelled")


def test_stopped_worker_leaves_its_job_to_be_gone_on_with(service: RunningService) -> None:
    job_id = service.post(name="slow")
    with Worker(service.settings) as worker:
        wait_until(lambda: count(service, job_id) >= 3)
        worker.process.send_signal(signal.SIGTERM)
        assert worker.process.wait(10) == 0
    ((pid, _),) = starts(service, job_id)
    wait_until(lambda: not is_alive(pid), 5)
    assert service.job(job_id)["state"] == "running"
    assert (service.settings.jobs / job_id / "capture").exists()


def test_another_worker_takes_over_from_a_dead_one(service: RunningService) -> None:
    job_id = service.post(name="slow")
    with Worker(service.settings, worker_id="a") as first, Worker(service.settings, worker_id="b") as second:
        wait_until(lambda: count(service, job_id) >= 3)
        # Whichever of them took the job is its trainer's parent.
        parent = parent_of(starts(service, job_id)[0][0])
        os.kill(parent, signal.SIGKILL)
        wait_until(lambda: len(starts(service, job_id)) == 2)
        assert parent_of(starts(service, job_id)[1][0]) in {first.process.pid, second.process.pid} - {parent}
        service.client.post(f"/jobs/{job_id}/cancel")


def parent_of(pid: int) -> int:
    with open(f"/proc/{pid}/stat") as file:
        return int(file.read().rsplit(")", 1)[1].split()[1])


def test_second_worker_of_the_same_name_is_not_let_in(service: RunningService) -> None:
    lock = worker_lock(service.settings, "a")
    assert lock.take()
    assert not worker_lock(service.settings, "a").take()
    assert worker_lock(service.settings, "b").take()
    lock.release()
    assert worker_lock(service.settings, "a").take()


def test_private_recovery_call_takes_executor_ids() -> None:
    """The job engine's only way to give a dead worker's jobs to another; `take_over` relies on it."""
    parameters = list(inspect.signature(DBOS._recover_pending_workflows).parameters)
    assert parameters == ["executor_ids"]


def test_supervised_worker_is_started_again_and_stopped_at_the_end() -> None:
    supervisor = Supervisor(["sleep", "60"])
    supervisor.start()
    wait_until(lambda: supervisor.pid is not None)
    first = supervisor.pid
    assert first is not None
    os.kill(first, signal.SIGKILL)
    wait_until(lambda: supervisor.pid not in (None, first))
    second = supervisor.pid
    assert second is not None
    supervisor.stop()
    assert not is_alive(second)
