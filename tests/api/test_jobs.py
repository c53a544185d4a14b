"""The life of a job through the API, with a worker that runs a fake trainer."""

import sqlite3

import pytest

from service.job_folder import JobFolder
from tests.api.captures import capture_files, zipped
from tests.api.running import RunningService, form_files, is_alive, wait_until


def folder_of(running: RunningService, job_id: str) -> JobFolder:
    return JobFolder(running.settings.jobs / job_id)


def trainer_pid(running: RunningService, job_id: str) -> int:
    """The process of the job's latest trainer."""
    log = folder_of(running, job_id).path / "starts.log"
    wait_until(log.exists)
    wait_until(lambda: log.read_text().strip() != "")
    return int(log.read_text().splitlines()[-1].split()[0])


@pytest.mark.parametrize("packed", [False, True])
def test_job_succeeds_and_offers_its_artifacts(running: RunningService, packed: bool) -> None:
    files = {"ball.zip": zipped(capture_files())} if packed else capture_files()
    answer = running.client.post("/jobs", data={"name": "quick", "preset": "draft"}, files=form_files(files))
    assert answer.status_code == 202
    job_id = answer.json()["id"]
    assert answer.headers["location"] == f"/jobs/{job_id}"
    job = running.wait(job_id)
    assert (job["state"], job["problem"], job["fraction"]) == ("succeeded", None, 1.0)
    assert job["options"]["preset"] == "draft"
    names = {artifact["name"] for artifact in job["artifacts"]}
    assert names == {"scene.glb", "preview.png", "report.json", "capture.json", "capture.png"}
    assert job["created"] <= job["started"] <= job["ended"]
    assert not folder_of(running, job_id).checkpoint.exists()
    assert len(list(folder_of(running, job_id).capture.rglob("*.png"))) == 10


def test_job_without_a_name_is_named_after_the_archive(running: RunningService) -> None:
    job_id = running.post({"teapot.zip": zipped(capture_files())})
    assert running.job(job_id)["name"] == "teapot"
    running.client.post(f"/jobs/{job_id}/cancel")


def test_photos_without_poses_are_accepted(running: RunningService) -> None:
    photos = {name: data for name, data in capture_files().items() if name.endswith(".png")}
    job_id = running.post(photos, name="quick", scene_kind="forward", skip_missing="true")
    job = running.wait(job_id)
    assert (job["state"], job["options"]["scene_kind"], job["options"]["skip_missing"]) == (
        "succeeded",
        "forward",
        True,
    )


def test_capture_report_is_there_while_the_job_still_runs(running: RunningService) -> None:
    job_id = running.post(name="slow")
    assert running.job(job_id)["capture"] is None or running.job(job_id)["state"] == "running"
    wait_until(lambda: running.job(job_id)["capture"] is not None)
    job = running.job(job_id)
    assert (job["state"], job["capture"]["lines"][0]["label"]) == ("running", "photos")
    answer = running.client.get(f"/jobs/{job_id}/artifacts/capture.png")
    assert (answer.status_code, answer.headers["content-type"]) == (200, "image/png")
    running.client.post(f"/jobs/{job_id}/cancel")


def test_newest_job_is_listed_first(running: RunningService) -> None:
    ids = [running.post(name="quick") for _ in range(2)]
    listed = [job["id"] for job in running.client.get("/jobs").json()["jobs"]]
    assert listed[:2] == ids[::-1]
    for job_id in ids:
        running.wait(job_id)


def test_refusal_of_the_trainer_is_the_jobs_problem_and_drops_the_upload(running: RunningService) -> None:
    job_id = running.post(name="refuse")
    job = running.wait(job_id)
    assert (job["state"], job["problem"]["code"]) == ("failed", "capture-empty")
    assert not folder_of(running, job_id).capture.exists()
    assert job["artifacts"] == []


def test_trainer_that_crashes_once_is_started_again(running: RunningService) -> None:
    assert running.wait(running.post(name="crash once"))["state"] == "succeeded"


def test_trainer_that_always_crashes_fails_the_job(running: RunningService) -> None:
    job = running.wait(running.post(name="crash"))
    assert (job["state"], job["problem"]["code"]) == ("failed", "job-interrupted")


def test_cancelled_job_leaves_no_process_and_no_upload(running: RunningService) -> None:
    job_id = running.post(name="slow")
    pid = trainer_pid(running, job_id)
    answer = running.client.post(f"/jobs/{job_id}/cancel")
    assert (answer.status_code, answer.json()["state"]) == (200, "cancelled")
    assert not is_alive(pid)
    assert not folder_of(running, job_id).capture.exists()
    assert not folder_of(running, job_id).checkpoint.exists()


def test_job_cancelled_while_it_waits_never_starts(running: RunningService) -> None:
    first, second = running.post(name="slow"), running.post(name="slow")
    trainer_pid(running, first)
    assert running.client.post(f"/jobs/{second}/cancel").json()["state"] == "cancelled"
    assert running.client.post(f"/jobs/{first}/cancel").json()["state"] == "cancelled"
    assert running.wait(running.post(name="quick"))["state"] == "succeeded"
    assert not (folder_of(running, second).path / "starts.log").exists()


def test_cancelling_an_ended_job_changes_nothing(running: RunningService) -> None:
    job_id = running.post(name="quick")
    running.wait(job_id)
    assert running.client.post(f"/jobs/{job_id}/cancel").json()["state"] == "succeeded"
    assert running.client.get(f"/jobs/{job_id}/artifacts/scene.glb").status_code == 200


def test_deleting_a_running_job_removes_process_files_and_rows(running: RunningService) -> None:
    job_id = running.post(name="slow")
    pid = trainer_pid(running, job_id)
    assert running.client.delete(f"/jobs/{job_id}").status_code == 204
    assert not is_alive(pid)
    assert not folder_of(running, job_id).path.exists()
    assert running.client.get(f"/jobs/{job_id}").json()["code"] == "job-not-found"
    assert rows_naming(running, job_id) == {}


def rows_naming(running: RunningService, job_id: str) -> dict[str, int]:
    """Table to the number of its rows that mention the job, where there are any."""
    found = {}
    with sqlite3.connect(running.settings.data / "jobs.sqlite") as database:
        tables = [row[0] for row in database.execute("select name from sqlite_master where type = 'table'")]
        for table in tables:
            rows = database.execute(f'select * from "{table}"').fetchall()
            count = sum(job_id in str(row) for row in rows)
            if count:
                found[table] = count
    return found


@pytest.mark.parametrize("path", ["/jobs/nonsense", f"/jobs/{'0' * 32}", "/jobs/..%2f..%2fetc"])
@pytest.mark.parametrize("suffix", ["", "/events", "/artifacts/scene.glb"])
def test_unknown_job_is_a_problem(running: RunningService, path: str, suffix: str) -> None:
    answer = running.client.get(path + suffix)
    assert (answer.status_code, answer.headers["content-type"]) == (404, "application/problem+json")
    assert answer.json()["code"] in ("job-not-found", "not-found")


def test_unknown_path_and_wrong_method_are_problems(running: RunningService) -> None:
    answers = [running.client.get("/nothing"), running.client.put("/jobs")]
    assert [answer.json()["code"] for answer in answers] == ["not-found", "method-not-allowed"]


def test_health_answers(running: RunningService) -> None:
    assert running.client.get("/health").json() == {"status": "ok"}
