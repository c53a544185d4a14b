"""A trainer that keeps the protocol but learns nothing: `python -m tests.api.fake_trainer FOLDER --parent PID`.

What it does is the job's name: "quick", "slow" (counts in checkpoint/), "crash" (each time), "crash once", "hang", or
"refuse". What an export of the job does is behind "then": "quick then slow".
"""

import json
import os
import sys
import time
from pathlib import Path
from typing import Any

from service.atomic import write_atomically
from service.parent import end_with_parent

SLOW_STEPS = 400
STEP_S = 0.05


def main() -> None:
    folder = Path(sys.argv[1])
    end_with_parent(int(sys.argv[3]))
    job, _, then = json.loads((folder / "job.json").read_text())["name"].partition(" then ")
    act = then if "--formats" in sys.argv else job
    (folder / "checkpoint").mkdir(exist_ok=True)
    if act == "refuse":
        send(problem={"code": "capture-empty", "status": 422, "detail": "all photos are transparent"})
        sys.exit(65)
    if act == "crash" or (act == "crash once" and not (folder / "checkpoint" / "crashed").exists()):
        (folder / "checkpoint" / "crashed").touch()
        sys.exit(1)
    if act == "hang":
        time.sleep(3600)
    if "--formats" in sys.argv:
        count(folder, SLOW_STEPS if act == "slow" else 4)
        export(folder / "artifacts", sys.argv[sys.argv.index("--formats") + 1].split(","))
        return
    lines = [{"label": "photos", "text": "10: 8 to train on, 2 held out to measure (r_0, r_1)", "warns": False}]
    write_atomically(folder / "artifacts" / "capture.png", b"png")
    write_atomically(folder / "artifacts" / "capture.json", json.dumps({"lines": lines}).encode())
    count(folder, SLOW_STEPS if act == "slow" else 4)
    for name, data in (("scene.glb", b"glTF" + bytes(1000)), ("preview.png", b"png"), ("report.json", b"{}")):
        write_atomically(folder / "artifacts" / name, data)


def export(artifacts: Path, formats: list[str]) -> None:
    """Leaves a file for each format, and its row in report.json."""
    from service.formats import FORMATS  # late: it takes NumPy

    report = json.loads((artifacts / "report.json").read_bytes())
    for name in formats:
        write_atomically(artifacts / FORMATS[name].file, b"one")
        report.setdefault("formats", {})[name] = {"file": FORMATS[name].file, "bytes": 3, "psnr": 20.0, "seconds": 0.1}
    write_atomically(artifacts / "report.json", json.dumps(report).encode())


def count(folder: Path, steps: int) -> None:
    """Counts up to `steps`, going on where it was stopped; traces every start in starts.log."""
    state = folder / "checkpoint" / "count"
    state.parent.mkdir(exist_ok=True)
    done = int(state.read_text()) if state.exists() else 0
    with (folder / "starts.log").open("a") as log:
        log.write(f"{os.getpid()} {done}\n")
    while done < steps:
        time.sleep(STEP_S)
        done += 1
        write_atomically(state, str(done).encode())
        send(report={"stage": "field", "fraction": done / steps, "psnr": 20.0, "preview": False})


def send(**message: Any) -> None:
    print(json.dumps(message), flush=True)


if __name__ == "__main__":
    main()
