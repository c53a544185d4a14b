"""A worker process kept alive."""

import logging
import subprocess
import threading
import time

FIRST_PAUSE_S = 0.5
LONGEST_PAUSE_S = 30.0
# A worker that lived so long was healthy: its next failure counts as the first again.
HEALTHY_S = 60.0
STOP_TIMEOUT_S = 10.0

log = logging.getLogger(__name__)


class Supervisor:
    """Runs a command as a child, and again whenever it ends, with growing pauses, until stopped.

    Args:
        command: the child's command line.
    """

    def __init__(self, command: list[str]) -> None:
        self._command = command
        self._stopping = threading.Event()
        self._process: subprocess.Popen[bytes] | None = None
        # The thread lives as long as the child: on Linux a parent's death is that of its thread.
        self._thread = threading.Thread(target=self._run, name="worker supervisor", daemon=True)

    @property
    def pid(self) -> int | None:
        """The child's, once there is one."""
        return self._process.pid if self._process else None

    def start(self) -> None:
        self._thread.start()

    def stop(self) -> None:
        """Ends the child and waits for it."""
        self._stopping.set()
        if self._process:
            self._process.terminate()
        self._thread.join(STOP_TIMEOUT_S)
        if self._process and self._process.poll() is None:
            self._process.kill()

    def _run(self) -> None:
        pause_s = FIRST_PAUSE_S
        while not self._stopping.is_set():
            started = time.monotonic()
            self._process = subprocess.Popen(self._command)
            if self._stopping.is_set():
                self._process.terminate()
            status = self._process.wait()
            if self._stopping.is_set():
                return
            pause_s = FIRST_PAUSE_S if time.monotonic() - started > HEALTHY_S else pause_s
            log.warning("the worker ended with status %d; again in %.1f s", status, pause_s)
            self._stopping.wait(pause_s)
            pause_s = min(2 * pause_s, LONGEST_PAUSE_S)
