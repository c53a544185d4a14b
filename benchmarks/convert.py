"""A whole conversion, measured: quality, size and time of what `polyfield convert` makes of a capture.

    python -m benchmarks.convert CAPTURE [--preset draft] [--set NAME=VALUE ...] [--goal-psnr DB] [--goal-seconds S]

Quality is that of the written scene.glb, read again, on the held-out views. Adds a row to convert.json and convert.md
in the results folder, and a picture of one held-out view beside them: photo, render, error. A row replaces the one of
the same name and hardware. With goals, the exit status is 1 where they are missed.
"""

import argparse
import sys
import time
from pathlib import Path

from PIL import Image

from benchmarks.hardware import hardware
from benchmarks.photo_options import photo_options_in, read_photos
from benchmarks.results import ConvertRow, add_row
from core.errors import PolyfieldError
from core.evaluation import comparison_picture
from exporters.gltf import read_glb
from service.commands.common import add_options, options_of
from service.commands.progress_bar import ProgressBar
from service.conversion import POSING, SCENE, convert
from service.options import Options
from service.report import Report

RESULTS = Path(__file__).parent / "results"
OUT = Path("out") / "benchmarks"


def main() -> int:
    arguments = _arguments()
    try:
        options = options_of(arguments)
        name = arguments.name or _name(arguments.capture, options)
        out = arguments.out or OUT / name
        row = measure(arguments, options, name, out)
        picture = _comparison(arguments, options, out, row.device)
    except PolyfieldError as error:
        sys.exit(f"error [{error.code}]: {error}")
    arguments.results.mkdir(parents=True, exist_ok=True)
    picture.save(arguments.results / f"{name}.png", optimize=True)
    add_row(arguments.results, row)
    print(row.as_text())
    return 0 if row.goals_met else 1


def measure(arguments: argparse.Namespace, options: Options, name: str, out: Path) -> ConvertRow:
    """Converts without checkpoints, and from the start, so that the seconds are comparable."""
    started, cpu_started = time.perf_counter(), time.process_time()
    with ProgressBar() as bar:
        report = convert(arguments.capture, out, **options.as_json(), progress=bar)
    seconds, cpu_seconds = time.perf_counter() - started, time.process_time() - cpu_started
    return _row(report, name, options, (seconds, cpu_seconds), (arguments.goal_psnr, arguments.goal_seconds))


def _row(
    report: Report,
    name: str,
    options: Options,
    seconds: tuple[float, float],
    goals: tuple[float | None, float | None],
) -> ConvertRow:
    return ConvertRow(
        name=name,
        preset=options.preset,
        overrides={key: report.settings[key] for key in options.overrides},
        hardware=hardware(report.device),
        device=report.device,
        views=dict(report.views),
        psnr=report.psnr.mean,
        ssim=report.ssim.mean,
        glb_bytes=report.bytes[SCENE],
        quads=report.quads,
        pages=report.pages,
        seconds={stage: value for stage, value in report.seconds.items() if stage != "total"},
        total_s=seconds[0],
        cpu_s=seconds[1],
        goal_psnr=goals[0],
        goal_s=goals[1],
    )


def _comparison(arguments: argparse.Namespace, options: Options, out: Path, device: str) -> Image.Image:
    posed = out / POSING  # of photos that came without poses
    capture = read_photos(posed if posed.is_dir() else arguments.capture, photo_options_in(options))
    views = capture.test or capture.train
    view = views[arguments.view % len(views)]
    picture = comparison_picture(read_glb((out / SCENE).read_bytes()), view, device=device)
    return Image.fromarray(picture[:, view.camera.size_px[0] :] if arguments.without_photo else picture)


def _name(capture: Path, options: Options) -> str:
    changes = [f"{key}{value}" for key, value in options.overrides.items()]
    changes += [f"downscale{options.downscale}"] if options.downscale > 1 else []
    changes += [f"max{options.max_size_px}px"] if options.max_size_px else []
    return "-".join([capture.resolve().stem, options.preset, *changes])


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("capture", type=Path)
    add_options(parser, preset="draft")
    parser.add_argument("--view", type=int, default=0, help="number of the held-out view in the picture")
    parser.add_argument(
        "--without-photo", action="store_true", help="leave the photo out of the picture: for photos that aren't ours"
    )
    parser.add_argument("--name", default="", help="of the row; default: capture, preset and what else was chosen")
    parser.add_argument("--out", type=Path, help=f"folder of the conversion; default: in {OUT}")
    parser.add_argument("--results", type=Path, default=RESULTS, help="folder of the table and the pictures")
    parser.add_argument("--goal-psnr", type=float, metavar="DB", help="mean PSNR to reach")
    parser.add_argument("--goal-seconds", type=float, metavar="S", help="wall clock not to exceed")
    return parser.parse_args()


if __name__ == "__main__":
    sys.exit(main())
