"""Servers and workers that end with the test."""

import json
import os
import socket
import subprocess
import sys
import threading
import time
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import asdict, replace
from types import TracebackType
from typing import Any

import httpx
import uvicorn

from service.app import create_app
from service.settings import ServiceSettings
from tests.api.captures import Files, capture_files

FAKE_TRAINER = (sys.executable, "-m", "tests.api.fake_trainer")
TIMEOUT_S = 30.0
ENDED = ("succeeded", "failed", "cancelled")


@asynccontextmanager
async def in_process(settings: ServiceSettings) -> AsyncIterator[httpx.AsyncClient]:
    """A client of an application in this process. It sees whole answers only, so no event streams."""
    app = create_app(settings)
    transport = httpx.ASGITransport(app, raise_app_exceptions=False)
    async with app.router.lifespan_context(app), httpx.AsyncClient(transport=transport, base_url="http://t") as client:
        yield client


class RunningService:
    """A server in a thread, and a client of it."""

    def __init__(self, settings: ServiceSettings) -> None:
        self.settings = settings
        with socket.socket() as probe:
            probe.bind(("127.0.0.1", 0))
            port = probe.getsockname()[1]
        config = uvicorn.Config(
            create_app(settings), port=port, log_level="warning", lifespan="on", timeout_graceful_shutdown=1
        )
        self._server = uvicorn.Server(config)
        self._thread = threading.Thread(target=self._server.run)
        self.client = httpx.Client(base_url=f"http://127.0.0.1:{port}", timeout=TIMEOUT_S)

    def __enter__(self) -> "RunningService":
        self._thread.start()
        wait_until(lambda: self._server.started)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.client.close()
        self._server.should_exit = True
        self._thread.join()

    def post(self, files: Files | None = None, **fields: Any) -> str:
        """A new job's id."""
        answer = self.client.post("/jobs", data=fields, files=form_files(files or capture_files()))
        assert answer.status_code == 202, answer.text
        return answer.json()["id"]

    def job(self, job_id: str) -> dict[str, Any]:
        return self.client.get(f"/jobs/{job_id}").json()

    def wait(self, job_id: str, *states: str, timeout_s: float = TIMEOUT_S) -> dict[str, Any]:
        """The job, once it is in one of the states (default: ended)."""
        wait_until(lambda: self.job(job_id)["state"] in (states or ENDED), timeout_s)
        return self.job(job_id)


class Worker:
    """A worker process."""

    def __init__(self, settings: ServiceSettings, **changes: Any) -> None:
        self.settings = replace(settings, **changes)

    def __enter__(self) -> "Worker":
        given = {name: value for name, value in asdict(self.settings).items() if name not in ("limits", "viewer")}
        given["data"] = str(given["data"])
        self.process = subprocess.Popen([sys.executable, "-m", "tests.api.worker_main", json.dumps(given)])
        return self

    def __exit__(self, *_: object) -> None:
        self.process.terminate()
        try:
            self.process.wait(10)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()

    def kill(self) -> None:
        """kill -9."""
        self.process.kill()
        self.process.wait()


def form_files(files: Files) -> list[tuple[str, tuple[str, bytes]]]:
    return [("files", (name, data)) for name, data in files.items()]


def wait_until(holds: Any, timeout_s: float = TIMEOUT_S) -> None:
    deadline = time.monotonic() + timeout_s
    while not holds():
        assert time.monotonic() < deadline, f"still waiting after {timeout_s} s"
        time.sleep(0.05)


def is_alive(pid: int) -> bool:
    """Whether a process runs; a zombie does not."""
    try:
        os.kill(pid, 0)
        with open(f"/proc/{pid}/stat") as file:
            return file.read().rsplit(")", 1)[1].split()[0] != "Z"
    except (ProcessLookupError, FileNotFoundError):
        return False
