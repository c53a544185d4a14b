"""Progress as server-sent events."""

import json
from typing import Any

from tests.api.running import RunningService


def read_events(running: RunningService, job_id: str, **headers: str) -> list[dict[str, Any]]:
    """Every event until the server ends the stream: id, event, data."""
    with running.client.stream("GET", f"/jobs/{job_id}/events", headers=headers) as answer:
        assert answer.headers["content-type"].startswith("text/event-stream")
        text = "".join(answer.iter_text())
    blocks = [block for block in text.split("\n\n") if block and not block.startswith(":")]
    events = [dict(line.split(": ", 1) for line in block.splitlines()) for block in blocks]
    return [{**event, "data": json.loads(event["data"])} for event in events]


def test_events_tell_the_stages_and_end_with_the_job(running: RunningService) -> None:
    *reports, end = read_events(running, running.post(name="quick"))
    assert [int(report["id"]) for report in reports] == list(range(1, len(reports) + 1))
    assert set(reports[-1]["data"]) == {"stage", "fraction", "psnr", "preview"}
    assert reports[-1]["data"]["fraction"] == 1.0
    assert (end["event"], end["data"]["state"]) == ("end", "succeeded")


def test_last_event_id_skips_what_was_seen(running: RunningService) -> None:
    job_id = running.post(name="slow")
    running.wait(job_id, "running")
    with running.client.stream("GET", f"/jobs/{job_id}/events") as answer:
        lines = (line for line in answer.iter_lines() if line.startswith("id: "))
        assert [next(lines), next(lines)] == ["id: 1", "id: 2"]
    running.client.post(f"/jobs/{job_id}/cancel")
    everything = read_events(running, job_id)
    rest = read_events(running, job_id, **{"Last-Event-ID": "2"})
    assert rest == everything[2:]
    assert rest[-1]["data"]["state"] == "cancelled"


def test_events_of_a_failed_job_end_with_its_problem(running: RunningService) -> None:
    end = read_events(running, running.post(name="refuse"))[-1]
    assert end["data"]["problem"]["code"] == "capture-empty"


def test_bad_last_event_id_is_a_problem(running: RunningService) -> None:
    job_id = running.post(name="quick")
    answer = running.client.get(f"/jobs/{job_id}/events", headers={"Last-Event-ID": "x"})
    assert (answer.status_code, answer.json()["code"]) == (422, "option-invalid")
    running.wait(job_id)
