"""A child that does not outlive its parent, even one that was killed with SIGKILL."""

import ctypes
import os
import signal
import sys
import threading
import time

PR_SET_PDEATHSIG = 1
POLL_S = 1.0


def end_with_parent(parent_pid: int, sign: signal.Signals = signal.SIGKILL) -> None:
    """From now on this process gets `sign` when process `parent_pid`, its parent, ends.

    Called by the child itself, as the first thing: code between fork and exec is unsafe in a parent with threads.
    """
    if sys.platform == "linux":
        ctypes.CDLL(None, use_errno=True).prctl(PR_SET_PDEATHSIG, int(sign))
    else:
        threading.Thread(target=_watch, args=(parent_pid, sign), daemon=True).start()
    if os.getppid() != parent_pid:  # it ended before we asked
        os.kill(os.getpid(), sign)


def _watch(parent_pid: int, sign: signal.Signals) -> None:
    while os.getppid() == parent_pid:
        time.sleep(POLL_S)
    os.kill(os.getpid(), sign)
