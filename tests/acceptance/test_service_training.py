"""The service with the real trainer, on a small capture: what must hold while a job trains and when things die."""

import json
import os
import signal
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from core.sample import write_sample_capture
from service.conversion import RESUMED
from service.settings import ServiceSettings
from tests.api.bad_inputs import BAD_INPUTS
from tests.api.captures import Files
from tests.api.running import RunningService, Worker, is_alive, wait_until
from tests.api.test_events import read_events

pytestmark = pytest.mark.slow

# About half a minute of training on two cores.
TRAINING = {
    "preset": "draft",
    "seed": "3",
    "set": ["cells=24", "nodes=48", "voxel_steps=400", "field_steps=250", "texel_steps=250"],
}
FINISH_S = 300.0


@pytest.fixture(scope="module")
def capture(tmp_path_factory: pytest.TempPathFactory) -> Files:
    folder = tmp_path_factory.mktemp("sample")
    write_sample_capture(folder, size_px=80, train_views=24, test_views=10)
    return {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


@pytest.fixture
def service(tmp_path: Path) -> Iterator[RunningService]:
    """A server without a worker."""
    with RunningService(ServiceSettings(data=tmp_path / "data", viewer=None, poll_s=0.2, worker_id="a")) as service:
        yield service


def trainers_of(worker_pid: int) -> list[int]:
    """The living children of a worker."""
    pids = [int(name) for name in os.listdir("/proc") if name.isdigit()]
    return [pid for pid in pids if is_alive(pid) and parent_of(pid) == worker_pid]


def parent_of(pid: int) -> int | None:
    try:
        return int(Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[1])
    except (FileNotFoundError, ProcessLookupError):
        return None


def report_of(service: RunningService, job_id: str) -> dict:
    return json.loads(service.client.get(f"/jobs/{job_id}/artifacts/report.json").content)


def wait_for_fraction(service: RunningService, job_id: str, fraction: float) -> None:
    wait_until(lambda: service.job(job_id)["fraction"] >= fraction, FINISH_S)


def test_job_killed_midway_finishes_from_its_checkpoint_as_well_as_an_undisturbed_one(
    service: RunningService, capture: Files
) -> None:
    with Worker(service.settings):
        undisturbed = service.post(capture, **TRAINING)
        assert service.wait(undisturbed, timeout_s=FINISH_S)["state"] == "succeeded"
    disturbed = service.post(capture, **TRAINING)
    checkpoint = service.settings.jobs / disturbed / "checkpoint" / "training.pt"
    with Worker(service.settings) as worker:
        wait_for_fraction(service, disturbed, 0.4)
        wait_until(lambda: checkpoint.exists(), FINISH_S)
        (trainer,) = trainers_of(worker.process.pid)
        os.kill(worker.process.pid, signal.SIGKILL)
        worker.process.wait()
        wait_until(lambda: not is_alive(trainer), 5)
    reached = service.job(disturbed)["fraction"]
    with Worker(service.settings):
        assert service.wait(disturbed, timeout_s=FINISH_S)["state"] == "succeeded"
    fractions = [event["data"]["fraction"] for event in read_events(service, disturbed)[:-1]]
    assert fractions == sorted(fractions)
    reports = [report_of(service, job_id) for job_id in (undisturbed, disturbed)]
    assert [RESUMED in report["notes"] for report in reports] == [False, True]
    psnr = [report["psnr"]["mean"] for report in reports]
    print(f"killed at {reached:.2f}; PSNR undisturbed {psnr[0]:.2f}, resumed {psnr[1]:.2f} dB")
    assert abs(psnr[0] - psnr[1]) < 0.2  # the bound of the acceptance list
    assert not checkpoint.parent.exists()


def test_training_job_is_cancelled_within_two_seconds_and_leaves_no_process(
    service: RunningService, capture: Files
) -> None:
    with Worker(service.settings) as worker:
        job_id = service.post(capture, **TRAINING)
        wait_for_fraction(service, job_id, 0.1)
        (trainer,) = trainers_of(worker.process.pid)
        started = time.monotonic()
        assert service.client.post(f"/jobs/{job_id}/cancel").json()["state"] == "cancelled"
        seconds = time.monotonic() - started
        print(f"cancelled after {seconds:.2f} s")
        assert seconds < 2.0
        assert not is_alive(trainer)
        assert trainers_of(worker.process.pid) == []


def test_api_answers_within_a_tenth_of_a_second_while_a_job_trains(service: RunningService, capture: Files) -> None:
    with Worker(service.settings):
        job_id = service.post(capture, **TRAINING)
        wait_for_fraction(service, job_id, 0.1)
        slowest = {}
        for path in ("/health", "/jobs", f"/jobs/{job_id}"):
            seconds = []
            for _ in range(40):
                started = time.perf_counter()
                assert service.client.get(path).status_code == 200
                seconds.append(time.perf_counter() - started)
                time.sleep(0.05)
            slowest[path] = max(seconds)
        print({path: f"{1e3 * value:.0f} ms" for path, value in slowest.items()})
        assert service.job(job_id)["state"] == "running"
        service.client.post(f"/jobs/{job_id}/cancel")
    assert max(slowest.values()) < 0.1


@pytest.mark.parametrize("name", ["truncated PNG", "all transparent"])
def test_what_only_decoding_shows_fails_the_job_with_the_same_problem(service: RunningService, name: str) -> None:
    case = BAD_INPUTS[name]
    with Worker(service.settings):
        job_id = service.post(case.files())
        job = service.wait(job_id)
    assert (job["state"], job["problem"]["code"], job["problem"]["status"]) == ("failed", case.code, case.status)
    for word in case.culprit:
        assert word in job["problem"]["detail"]
    folder = service.settings.jobs / job_id
    assert not (folder / "capture").exists()
    assert not list((folder / "artifacts").iterdir())
