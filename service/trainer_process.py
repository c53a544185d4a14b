"""The process that runs one job, as its worker sees it.

Protocol: the trainer writes JSON objects to stdout, a line each. `{"report": {...}}` tells its progress,
`{"problem": {...}}` why it cannot go on. Exit status 0 means done; 65 (EX_DATAERR) that the input was refused, 70
(EX_SOFTWARE) that the work failed for good; both follow a problem. Anything else is a crash, worth another attempt.
"""

import asyncio
import json
import logging
import os
import signal
import time
from collections.abc import Awaitable, Callable
from contextlib import suppress
from typing import Any

from service.job_folder import JobFolder
from service.throttle import Throttle

EXIT_REFUSED = 65
EXIT_FAILED = 70
# The stream's reader and its database see no more than two reports a second.
REPORT_INTERVAL_S = 0.5
LINE_LIMIT_BYTES = 1 << 20

log = logging.getLogger(__name__)
Publish = Callable[[dict[str, Any]], Awaitable[None]]


class TrainerDied(Exception):
    """The trainer crashed or was killed. Plain, because the job engine stores it."""


class TrainerHung(Exception):
    """The trainer said nothing for too long."""


async def run_trainer(
    command: tuple[str, ...], folder: JobFolder, publish: Publish, stall_s: float, *arguments: str
) -> dict[str, Any] | None:
    """Runs the trainer to its end and returns its problem, or None where it succeeded.

    However this coroutine ends, cancellation included, no process of the trainer's session is left.

    Args:
        command: to which the job's folder is appended; the trainer is told this process's id as `--parent`.
        arguments: of the trainer, beside the folder.
        publish: is given each report, at most two a second, and always the last one.
        stall_s: silence after which the trainer is taken for hung.

    Raises:
        TrainerDied, TrainerHung
        BlockingIOError: an earlier trainer of this job still lives.
    """
    with folder.lock() as lock, folder.log.open("ab") as stderr:
        process = await asyncio.create_subprocess_exec(
            *command,
            str(folder.path),
            "--parent",
            str(os.getpid()),
            *arguments,
            stdin=asyncio.subprocess.DEVNULL,
            stdout=asyncio.subprocess.PIPE,
            stderr=stderr,
            start_new_session=True,
            pass_fds=(lock.fileno(),),  # so that the folder stays locked until the trainer itself is gone
            limit=LINE_LIMIT_BYTES,
        )
        try:
            problem = await _follow(process, publish, stall_s)
            status = await process.wait()
        finally:
            await _end(process)
    if status == 0 or (problem and status in (EXIT_REFUSED, EXIT_FAILED)):
        return problem
    raise TrainerDied(f"exit status {status}")


async def _follow(process: asyncio.subprocess.Process, publish: Publish, stall_s: float) -> dict[str, Any] | None:
    assert process.stdout is not None
    problem: dict[str, Any] | None = None
    throttle = Throttle[dict[str, Any]](REPORT_INTERVAL_S)
    while line := await _line(process.stdout, stall_s):
        message = _message(line)
        problem = message.get("problem", problem)
        if "report" in message and (report := throttle.offer(message["report"], time.monotonic())):
            await publish(report)
    if last := throttle.rest():
        await publish(last)
    return problem


async def _line(stdout: asyncio.StreamReader, stall_s: float) -> bytes:
    try:
        return await asyncio.wait_for(stdout.readline(), stall_s)
    except TimeoutError:
        raise TrainerHung(f"no report for {stall_s:.0f} s") from None


def _message(line: bytes) -> dict[str, Any]:
    try:
        message = json.loads(line)
    except ValueError:
        message = None
    if not isinstance(message, dict):
        log.warning("not a trainer's message: %r", line[:200])
        return {}
    return message


async def _end(process: asyncio.subprocess.Process) -> None:
    """Ends the trainer's whole session. Checkpoints survive any death, so there is nothing to be polite about."""
    with suppress(ProcessLookupError):
        os.killpg(process.pid, signal.SIGKILL)
    await process.wait()
