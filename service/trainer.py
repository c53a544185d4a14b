"""Runs one job: `python -m service.trainer JOB_FOLDER --parent PID`; with `--formats LIST`, an export of its scene.

See trainer_process for what it writes.
"""

import argparse
import json
import logging
import os
import sys
from pathlib import Path
from typing import IO, Any

from core.errors import InputError, PolyfieldError
from core.progress import Progress
from service.atomic import write_atomically
from service.conversion import SCENE, convert
from service.export import export
from service.formats import formats_of
from service.job_folder import JobFolder
from service.options import Options
from service.parent import end_with_parent
from service.preview import png_bytes
from service.problems import problem_of
from service.trainer_process import EXIT_FAILED, EXIT_REFUSED

# Training takes every core for minutes; the server has to be faster than that to answer.
NICENESS = 10


def main() -> int:
    arguments = _arguments()
    end_with_parent(arguments.parent)
    os.nice(NICENESS)
    logging.basicConfig(level=logging.INFO, stream=sys.stderr)
    channel = _claim_stdout()
    folder = JobFolder(arguments.folder)
    try:
        if arguments.formats:
            _export(folder, formats_of(arguments.formats), channel)
        else:
            _run(folder, channel)
    except PolyfieldError as error:
        _send(channel, problem=problem_of(error))
        logging.exception("refused" if isinstance(error, InputError) else "failed")
        return EXIT_REFUSED if isinstance(error, InputError) else EXIT_FAILED
    return 0


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="service.trainer")
    parser.add_argument("folder", type=Path)
    parser.add_argument("--parent", type=int, required=True)
    parser.add_argument("--formats", default="", help="export the job's scene, which is there, to these")
    return parser.parse_args()


def _run(folder: JobFolder, channel: IO[str]) -> None:
    request = folder.request()
    options = Options.from_json(request["options"])
    preview = folder.artifacts / "preview.png"
    # One that goes on from a checkpoint starts behind what was last reported; the bar waits for it there.
    reached = folder.progress().get("fraction", 0.0)

    def progress(report: Progress) -> None:
        if report.preview_u8 is not None:
            write_atomically(preview, png_bytes(report.preview_u8))
        numbers = {"stage": report.stage, "fraction": max(reached, report.fraction), "psnr": report.psnr}
        _send(channel, report=numbers | {"preview": preview.exists()})

    convert(
        folder.capture,
        folder.artifacts,
        **options.as_json(),
        title=request["name"],
        progress=progress,
        checkpoint_dir=folder.checkpoint,
        posing_dir=folder.posing,
    )


def _export(folder: JobFolder, formats: tuple[str, ...], channel: IO[str]) -> None:
    """Writes more formats of the job's scene.glb, measured on the photos that were held out of its training."""
    request = folder.request()
    options = Options.from_json(request["options"])

    def progress(report: Progress) -> None:
        _send(channel, report={"stage": report.stage, "fraction": report.fraction})

    export(
        folder.artifacts / SCENE,
        folder.artifacts,
        formats,
        capture=folder.capture if folder.capture.exists() else None,
        photos=options.photos(),
        posing_dir=folder.posing,
        title=request["name"],
        device=options.device,
        progress=progress,
    )


def _claim_stdout() -> IO[str]:
    """The pipe to the worker. Whatever else prints, native libraries included, goes to the log from here on."""
    channel = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(2, 1)
    return channel


def _send(channel: IO[str], **message: Any) -> None:
    channel.write(json.dumps(message) + "\n")
    channel.flush()


if __name__ == "__main__":
    sys.exit(main())
