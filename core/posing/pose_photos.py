"""Posing in a process of its own.

COLMAP is native code: it takes memory that Python cannot give back, installs handlers for signals, shares OpenMP with
PyTorch to the harm of both, and ends its process where it finds an invariant broken. In a child, none of this matters;
Ctrl-C works at once, and after a crash the child is started again and goes on from its database.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

from core.errors import PosingFailed
from core.posing.photo_set import find_photo_set
from core.posing.posing import Posing
from core.posing.workspace import Workspace, own_folder
from core.progress import Progress, ProgressCallback, ignore_progress

ATTEMPTS = 3
# One thread, because the order of its threads' sums would show in the cameras.
ENVIRONMENT = {"OMP_NUM_THREADS": "1", "OMP_WAIT_POLICY": "passive"}
SOURCE = Path(__file__).resolve().parents[2]


def pose_photos(
    photos_folder: Path, work_folder: Path, *, progress: ProgressCallback = ignore_progress, seed: int = 0
) -> Posing:
    """Estimates the cameras of photos. A finished posing of the same photos is returned as it is.

    Interrupted, however it was, it goes on with the features and matches that it had; the mapper starts again. The same
    photos and seed give the same cameras on one machine.

    Args:
        photos_folder: photos anywhere below; see `find_photo_set`.
        work_folder: is made; gets what `Workspace` says. `core.datasets.read_capture` reads it afterwards.
        progress: is told stage (features, matching, mapping) and fraction of the posing.

    Returns:
        The outcome, also where too few photos could be posed: ask `Posing.require_usable`.

    Raises:
        NoImages, TooFewImages, PosingFailed
    """
    photos_folder, work_folder = Path(photos_folder).absolute(), Path(work_folder).absolute()
    find_photo_set(photos_folder, without=own_folder(work_folder, photos_folder))
    for attempt in range(1, ATTEMPTS + 1):
        fault = _run_child(photos_folder, work_folder, seed, progress)
        posing = Workspace(work_folder).outcome()
        if not fault and posing:
            return posing
        if attempt == ATTEMPTS:
            raise PosingFailed(
                "cameras of the photos",
                "COLMAP must come to an end",
                fault,
                "Leave out damaged or very large photos, or pose them elsewhere and add the pose file.",
            )
    raise AssertionError("unreachable")


def _run_child(photos_folder: Path, work_folder: Path, seed: int, progress: ProgressCallback) -> str:
    """Runs the child to its end; returns what it died of, "" for nothing."""
    command = [sys.executable, "-m", "core.posing.child", str(photos_folder), str(work_folder), str(seed)]
    search = os.pathsep.join([str(SOURCE), os.environ.get("PYTHONPATH", "")]).rstrip(os.pathsep)
    environment = {**os.environ, **ENVIRONMENT, "PYTHONPATH": search}
    with tempfile.TemporaryFile() as log:
        child = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=log, env=environment, text=True)
        try:
            assert child.stdout is not None
            for line in child.stdout:
                report = json.loads(line)
                progress(Progress(report["stage"], report["fraction"]))
            status = child.wait()
        finally:
            child.kill()
            child.wait()
        log.seek(0)
        last = log.read()[-300:].decode("utf-8", "replace").strip().rpartition("\n")[2]
    return f"exit status {status}: {last}" if status else ""
