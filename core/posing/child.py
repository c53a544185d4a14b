"""`python -m core.posing.child PHOTOS WORK SEED`: see pose_photos. Progress goes to stdout, a JSON object a line."""

from __future__ import annotations

import json
import os
import sys
import threading
import time
from pathlib import Path
from typing import IO

from core.posing.structure_from_motion import posed_in_this_process
from core.progress import Progress

POLL_S = 1.0


def main() -> None:
    _end_with_parent()
    photos_folder, work_folder, seed = Path(sys.argv[1]), Path(sys.argv[2]), int(sys.argv[3])
    channel = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(2, 1)  # whatever COLMAP prints is no progress
    posed_in_this_process(photos_folder, work_folder, seed=seed, progress=lambda report: _send(channel, report))


def _send(channel: IO[str], report: Progress) -> None:
    channel.write(json.dumps({"stage": report.stage, "fraction": report.fraction}) + "\n")
    channel.flush()


def _end_with_parent() -> None:
    """Nobody wants the result of a child whose parent was killed."""
    parent = os.getppid()

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(POLL_S)
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


if __name__ == "__main__":
    main()
