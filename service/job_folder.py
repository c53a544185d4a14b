"""Where a job's files are."""

import fcntl
import json
import re
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any

from service.atomic import write_atomically

JOB_ID = re.compile(r"[0-9a-f]{32}")


@dataclass(frozen=True)
class JobFolder:
    """The files of one job.

    capture/         the upload. Kept after success, so that another export can be measured on the same held-out
                     views; the scene itself is read back from artifacts/scene.glb.
    posing/          of photos without poses: what was found of their cameras. Kept like the upload.
    checkpoint/      the trainer's state; gone once the job has ended.
    artifacts/       what a client may download.
    job.json         the request: id, name, created_at, images, options.
    progress.json    the latest report, for those who come later than the stream's.
    export.json      the same of the latest export that was asked for once the job had succeeded.
    trainer.log      the trainer's stderr.
    trainer.lock     held by whoever works in the folder.
    """

    path: Path

    @property
    def id(self) -> str:
        return self.path.name

    @property
    def capture(self) -> Path:
        return self.path / "capture"

    @property
    def posing(self) -> Path:
        return self.path / "posing"

    @property
    def checkpoint(self) -> Path:
        return self.path / "checkpoint"

    @property
    def artifacts(self) -> Path:
        return self.path / "artifacts"

    @property
    def log(self) -> Path:
        return self.path / "trainer.log"

    def request(self) -> dict[str, Any]:
        """job.json, or {} when the folder is gone."""
        return _read_json(self.path / "job.json")

    def write_request(self, request: dict[str, Any]) -> None:
        _write_json(self.path / "job.json", request)

    def progress(self) -> dict[str, Any]:
        """The latest report: stage, fraction, psnr, preview; {} before the first."""
        return _read_json(self.path / "progress.json")

    def write_progress(self, report: dict[str, Any]) -> None:
        _write_json(self.path / "progress.json", report)

    def drop_inputs(self) -> None:
        """Removes the upload and what was made of it: a job that was refused or cancelled has no use for it."""
        shutil.rmtree(self.capture, ignore_errors=True)
        shutil.rmtree(self.posing, ignore_errors=True)
        self.drop_checkpoint()

    def drop_checkpoint(self) -> None:
        shutil.rmtree(self.checkpoint, ignore_errors=True)

    def remove(self) -> None:
        shutil.rmtree(self.path, ignore_errors=True)

    def export_progress(self) -> dict[str, Any]:
        """The latest report of an export: id, stage, fraction; {} before the first."""
        return _read_json(self.path / "export.json")

    def write_export_progress(self, report: dict[str, Any]) -> None:
        _write_json(self.path / "export.json", report)

    @contextmanager
    def lock(self) -> Iterator[IO[bytes]]:
        """Holds the folder; yields the lock's file, which a child may inherit and then holds it too.

        The kernel frees the lock when the last process with the file ends, however it ends.

        Raises:
            BlockingIOError: somebody else still holds it.
            FileNotFoundError: the job is gone.
        """
        with (self.path / "trainer.lock").open("ab") as file:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            yield file


def _read_json(path: Path) -> dict[str, Any]:
    try:
        return json.loads(path.read_bytes())
    except FileNotFoundError:
        return {}


def _write_json(path: Path, value: dict[str, Any]) -> None:
    write_atomically(path, json.dumps(value, indent=1).encode())
