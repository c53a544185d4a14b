"""An in-memory stand-in for the jobs API, for tests of the pages alone."""

import json
from dataclasses import dataclass, field
from typing import Any

from tests.browser.site import Answer

JSON = "application/json"
FORMATS = [
    {"name": name, "file": file, "text": f"the {name} form", "opens_in": "a viewer"}
    for name, file in (("glb", "scene.glb"), ("web", "scene.web.glb"), ("usd", "scene.usd.zip"))
]


@dataclass
class FakeJobs:
    """The jobs by id, and what was asked of them.

    Attributes:
        jobs: what GET /jobs lists.
        previews: PNGs by job id.
        captures: PNGs of capture reports by job id.
        events: server-sent progress by job id; ends with `end`.
        refusal: the problem that POST /jobs answers with, when given.
        requests: (method, path) of all requests that change something.
        uploads: bodies of POST /jobs.
    """

    jobs: list[dict[str, Any]] = field(default_factory=list)
    previews: dict[str, bytes] = field(default_factory=dict)
    captures: dict[str, bytes] = field(default_factory=dict)
    events: dict[str, list[dict[str, Any]]] = field(default_factory=dict)
    refusal: dict[str, Any] | None = None
    requests: list[tuple[str, str]] = field(default_factory=list)
    uploads: list[bytes] = field(default_factory=list)

    def __call__(self, method: str, path: str, body: bytes) -> Answer | None:
        if path == "/formats":
            return _json(200, {"formats": FORMATS})
        if not path.startswith("/jobs"):
            return None
        if method != "GET":
            self.requests.append((method, path))
        if path == "/jobs":
            return self._create(body) if method == "POST" else _json(200, {"jobs": self.jobs})
        job_id, _, rest = path.removeprefix("/jobs/").partition("/")
        if method == "DELETE":
            self.jobs = [job for job in self.jobs if job["id"] != job_id]
            return 204, JSON, b""
        if rest == "events":
            return 200, "text/event-stream", self._stream(job_id)
        if rest == "artifacts/preview.png" and job_id in self.previews:
            return 200, "image/png", self.previews[job_id]
        if rest == "artifacts/capture.png" and job_id in self.captures:
            return 200, "image/png", self.captures[job_id]
        job = next((job for job in self.jobs if job["id"] == job_id), None)
        if rest == "cancel" and job:
            job["state"] = "cancelled" if job["export"] is None else job["state"]
            job["export"] = job["export"] and job["export"] | {"state": "cancelled"}
        if rest == "exports" and job:
            job["export"] = {"state": "queued", "formats": json.loads(body)["formats"], "stage": None, "fraction": 0.0}
        return _json(200, job) if job and rest in ("", "cancel", "exports") else _json(404, {"code": "job-not-found"})

    def _create(self, body: bytes) -> Answer:
        self.uploads.append(body)
        if self.refusal:
            return self.refusal["status"], "application/problem+json", json.dumps(self.refusal).encode()
        self.jobs = [fake_job("new0", "queued", created="2026-01-09T00:00:00Z"), *self.jobs]
        return _json(202, self.jobs[0])

    def _stream(self, job_id: str) -> bytes:
        lines = [f"id: {i + 1}\ndata: {json.dumps(event)}\n\n" for i, event in enumerate(self.events.get(job_id, []))]
        return "".join([*lines, "retry: 60000\n\n"]).encode()


def fake_job(job_id: str, state: str, **changes: Any) -> dict[str, Any]:
    """A job as the API shows it."""
    return {
        "id": job_id,
        "name": "",
        "state": state,
        "created": "2026-01-01T00:00:00.000+00:00",
        "options": {"preset": "draft"},
        "stage": None,
        "fraction": 0.0,
        "psnr": None,
        "preview": False,
        "capture": None,
        "problem": None,
        "artifacts": [],
        "formats": {},
        "export": None,
        **changes,
    }


def _json(status: int, value: Any) -> Answer:
    return status, JSON, json.dumps(value).encode()
