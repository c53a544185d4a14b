"""Exports of a job that has succeeded: through the API, by a worker with a fake trainer."""

from typing import Any

import httpx
import pytest

from service.formats import FORMATS
from tests.api.running import RunningService, is_alive, wait_until
from tests.api.test_jobs import folder_of, rows_naming, trainer_pid


def succeeded(running: RunningService, name: str = "quick then quick") -> str:
    """The id of a job that has succeeded; `then` says what its export will do."""
    job_id = running.post(name=name)
    assert running.wait(job_id)["state"] == "succeeded"
    return job_id


def ask(running: RunningService, job_id: str, formats: Any) -> httpx.Response:
    return running.client.post(f"/jobs/{job_id}/exports", json={"formats": formats})


def export_of(running: RunningService, job_id: str, *states: str) -> dict[str, Any]:
    """The job's export, once it is in one of the states (default: ended)."""
    wait_until(lambda: running.job(job_id)["export"]["state"] in (states or ("succeeded", "failed", "cancelled")))
    return running.job(job_id)["export"]


def test_formats_are_listed_with_what_opens_them(running: RunningService) -> None:
    listed = running.client.get("/formats").json()["formats"]
    assert [one["name"] for one in listed] == list(FORMATS)
    assert all(one["file"] and one["text"] and one["opens_in"] and one["media_type"] for one in listed)


@pytest.mark.parametrize("formats", [["web", "viewer"], "viewer,web"])
def test_finished_job_is_exported_to_more_formats(running: RunningService, formats: Any) -> None:
    job_id = succeeded(running)
    assert running.job(job_id)["export"] is None
    answer = ask(running, job_id, formats)
    assert (answer.status_code, answer.json()["state"], answer.json()["export"]["formats"]) == (
        202,
        "succeeded",
        ["web", "viewer"],
    )
    export = export_of(running, job_id)
    assert (export["state"], export["fraction"], export["problem"]) == ("succeeded", 1.0, None)
    job = running.job(job_id)
    assert job["state"] == "succeeded"
    assert {"scene.glb", "scene.web.glb", "viewer.zip"} <= {artifact["name"] for artifact in job["artifacts"]}
    assert set(job["formats"]) == {"web", "viewer"}
    assert running.client.get(f"/jobs/{job_id}/artifacts/viewer.zip").headers["content-type"] == "application/zip"
    assert running.client.get("/jobs").json()["jobs"][0]["export"] == job["export"]


def test_single_page_is_downloaded_rather_than_opened(running: RunningService) -> None:
    job_id = succeeded(running)
    ask(running, job_id, ["html"])
    export_of(running, job_id)
    headers = running.client.get(f"/jobs/{job_id}/artifacts/viewer.html").headers
    assert headers["content-disposition"].startswith("attachment")


@pytest.mark.parametrize(
    ("body", "code", "status"),
    [
        (b'{"formats": ["fbx"]}', "unknown-format", 422),
        (b'{"formats": []}', "unknown-format", 422),
        (b'{"formats": [1]}', "request-invalid", 400),
        (b'{"formats": null}', "request-invalid", 400),
        (b'["web"]', "request-invalid", 400),
        (b"web", "request-invalid", 400),
        (b"\xff", "request-invalid", 400),
        (b"[" * 60_000, "request-invalid", 400),
        (b" " * 70_000, "upload-too-large", 413),
    ],
)
def test_bad_request_is_a_problem_and_leaves_nothing(
    running: RunningService, body: bytes, code: str, status: int
) -> None:
    job_id = succeeded(running)
    before = sorted(folder_of(running, job_id).path.rglob("*"))
    answer = running.client.post(f"/jobs/{job_id}/exports", content=body)
    assert (answer.status_code, answer.json()["code"]) == (status, code)
    assert running.job(job_id)["export"] is None
    assert sorted(folder_of(running, job_id).path.rglob("*")) == before


def test_unknown_job_is_a_problem(running: RunningService) -> None:
    answer = ask(running, "0" * 32, ["web"])
    assert (answer.status_code, answer.json()["code"]) == (404, "job-not-found")
    assert not (running.settings.jobs / ("0" * 32)).exists()


def test_unfinished_and_failed_jobs_are_not_exported(running: RunningService) -> None:
    for name, state in (("refuse", "failed"), ("slow", "running")):
        job_id = running.post(name=name)
        running.wait(job_id, state)
        answer = ask(running, job_id, ["web"])
        assert (answer.status_code, answer.json()["code"]) == (409, "job-unfinished")
        assert running.job(job_id)["export"] is None
        running.client.post(f"/jobs/{job_id}/cancel")


def test_one_export_of_a_job_at_a_time(running: RunningService) -> None:
    job_id = succeeded(running, "quick then slow")
    assert ask(running, job_id, ["web"]).status_code == 202
    answer = ask(running, job_id, ["lq"])
    assert (answer.status_code, answer.json()["code"]) == (409, "job-busy")
    running.client.post(f"/jobs/{job_id}/cancel")


def test_cancelled_export_stops_and_leaves_the_job_as_it_was(running: RunningService) -> None:
    job_id = succeeded(running, "quick then slow")
    before = trainer_pid(running, job_id)
    ask(running, job_id, ["web"])
    wait_until(lambda: trainer_pid(running, job_id) != before)
    wait_until(lambda: running.job(job_id)["export"]["fraction"] > 0)
    pid = trainer_pid(running, job_id)
    job = running.client.post(f"/jobs/{job_id}/cancel").json()
    assert (job["state"], job["export"]["state"]) == ("succeeded", "cancelled")
    assert not is_alive(pid)
    assert folder_of(running, job_id).capture.exists()
    assert running.client.get(f"/jobs/{job_id}/artifacts/scene.glb").status_code == 200
    assert running.client.get(f"/jobs/{job_id}/artifacts/scene.web.glb").status_code == 404
    assert ask(running, job_id, ["web"]).status_code == 202  # nothing is in the way of the next one
    running.client.post(f"/jobs/{job_id}/cancel")


def test_export_that_fails_says_why_and_the_job_stays(running: RunningService) -> None:
    refused, crashed = succeeded(running, "quick then refuse"), succeeded(running, "quick then crash")
    for job_id, code in ((refused, "capture-empty"), (crashed, "job-interrupted")):
        ask(running, job_id, ["web"])
        export = export_of(running, job_id)
        assert (export["state"], export["problem"]["code"]) == ("failed", code)
        assert running.job(job_id)["state"] == "succeeded"
        assert folder_of(running, job_id).capture.exists()


def test_deleting_a_job_stops_its_export_and_removes_its_rows(running: RunningService) -> None:
    job_id = succeeded(running, "quick then slow")
    before = trainer_pid(running, job_id)
    ask(running, job_id, ["web"])
    wait_until(lambda: trainer_pid(running, job_id) != before)
    pid = trainer_pid(running, job_id)
    assert running.client.delete(f"/jobs/{job_id}").status_code == 204
    assert not is_alive(pid)
    assert not folder_of(running, job_id).path.exists()
    assert rows_naming(running, job_id) == {}
