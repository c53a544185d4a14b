"""`polyfield demo`: the whole service on the sample capture, from upload to download."""

import argparse
import contextlib
import json
import os
import signal
import socket
import subprocess
import sys
import tempfile
import time
import zipfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import httpx

from core.errors import PolyfieldError
from service.commands.common import add_options, form_words
from service.commands.progress_bar import ProgressBar
from service.report import Report

OUT = Path("out") / "demo"
START_TIMEOUT_S = 60.0
STOP_TIMEOUT_S = 15.0


class DemoFailed(PolyfieldError):
    code = "demo-failed"


def add_parser(subparsers: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    parser = subparsers.add_parser("demo", help="start a service, convert the sample capture with it, stop it")
    parser.add_argument("--data", type=Path, help="folder of the service; default: a temporary one")
    parser.add_argument("-o", "--out", type=Path, default=OUT, metavar="DIR", help=f"default: {OUT}")
    parser.add_argument("--capture", type=Path, help="folder to convert instead of the sample")
    add_options(parser, preset="draft")
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    with tempfile.TemporaryDirectory(prefix="polyfield-demo-") as scratch:
        archive = _packed(arguments.capture or _sample(Path(scratch) / "sample"), Path(scratch) / "capture.zip")
        with _service(arguments.data or Path(scratch) / "data") as client:
            job = _post(client, archive, arguments)
            print(f"job      {client.base_url}/jobs/{job['id']}", flush=True)
            _follow(client, job["id"])
            _download(client, job["id"], arguments.out)
    print(Report.from_bytes((arguments.out / "report.json").read_bytes()).as_table())
    print(f"written to {arguments.out}")
    return 0


def _sample(folder: Path) -> Path:
    from core.sample import write_sample_capture

    with ProgressBar() as bar:
        write_sample_capture(folder, progress=bar)
    return folder


def _packed(capture: Path, archive: Path) -> Path:
    with zipfile.ZipFile(archive, "w", zipfile.ZIP_STORED) as zipped:
        for path in sorted(capture.rglob("*")):
            if path.is_file():
                zipped.write(path, path.relative_to(capture))
    return archive


@contextlib.contextmanager
def _service(data: Path) -> Iterator[httpx.Client]:
    """A client of a service that lives as long as the context."""
    port = _free_port()
    command = [sys.executable, "-m", "service.cli", "serve", "--port", str(port), "--data", str(data)]
    command += ["--log-level", "warning"]
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL)
    try:
        with httpx.Client(base_url=f"http://127.0.0.1:{port}", timeout=60.0) as client:
            _await_health(client, process)
            yield client
    finally:
        _stop(process)


def _free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


def _await_health(client: httpx.Client, process: "subprocess.Popen[bytes]") -> None:
    deadline = time.monotonic() + START_TIMEOUT_S
    while time.monotonic() < deadline and process.poll() is None:
        with contextlib.suppress(httpx.TransportError):
            client.get("/health").raise_for_status()
            return
        time.sleep(0.1)
    raise DemoFailed("service", "must start", f"exit status {process.poll()}", "Its messages are above.")


def _stop(process: "subprocess.Popen[bytes]") -> None:
    process.send_signal(signal.SIGINT if os.name == "nt" else signal.SIGTERM)
    try:
        process.wait(STOP_TIMEOUT_S)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()


def _post(client: httpx.Client, archive: Path, arguments: argparse.Namespace) -> dict[str, Any]:
    words = form_words(arguments) | {"name": "demo", "set": arguments.set}
    with archive.open("rb") as file:
        answer = client.post("/jobs", data=words, files={"files": (archive.name, file)}, timeout=None)
    if answer.status_code != 202:
        raise _refused(answer.json())
    return answer.json()


def _follow(client: httpx.Client, job_id: str) -> None:
    """Shows the job's events until the last one.

    Raises:
        DemoFailed: the job did not succeed.
    """
    job: dict[str, Any] = {}
    with ProgressBar() as bar, client.stream("GET", f"/jobs/{job_id}/events", timeout=None) as answer:
        for name, value in _events(answer.iter_lines()):
            if name == "end":
                job = value
            else:
                bar.show(value["stage"], value["fraction"], value["psnr"])
    if job.get("state") != "succeeded":
        raise _refused(job.get("problem") or {"detail": f"ended as {job.get('state')}"})


def _events(lines: Iterator[str]) -> Iterator[tuple[str, Any]]:
    """(name, value) of server-sent events."""
    name = ""
    for line in lines:
        field, _, text = line.partition(": ")
        if field == "event":
            name = text
        elif field == "data":
            yield name, json.loads(text)
        elif not line:
            name = ""


def _download(client: httpx.Client, job_id: str, folder: Path) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    for artifact in client.get(f"/jobs/{job_id}").raise_for_status().json()["artifacts"]:
        answer = client.get(artifact["url"])
        answer.raise_for_status()
        (folder / artifact["name"]).write_bytes(answer.content)


def _refused(problem: dict[str, Any]) -> DemoFailed:
    return DemoFailed("job", "must succeed", f"{problem.get('code', 'unknown')}: {problem.get('detail', '')}")
