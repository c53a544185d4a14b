"""Quality against training time: our presets, and the paper's own setting, in one run.

    python -m benchmarks.train CAPTURE [--presets draft balanced high] [--reference-seconds S] [--device auto]

Curves are measured on held-out views while training, at growing intervals, and measuring does not count. The final
figures are of the written .glb, read again, over all held-out views; their seconds are those of training and baking,
without reading, compiling and measuring. Every setting runs in a process of its own. Adds rows to train.json and
train.md in the results folder and draws a chart for the capture and device.
"""

import argparse
import sys
import time
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import torch

from benchmarks.chart import Curve, draw_chart
from benchmarks.child_process import gpu_memory_bytes, in_child, peak_memory_bytes
from benchmarks.hardware import hardware
from benchmarks.photo_options import add_photo_options, photo_options_of, read_photos
from benchmarks.reference_setting import PaperRun, PaperSetting, bake_paper
from benchmarks.reference_setting.setting import ON_A_CPU
from benchmarks.reference_setting.training import Moment
from benchmarks.tables import figure, markdown, merged
from benchmarks.watching import CurvePoint, Watch
from core.baked import BakedScene
from core.capture import Capture
from core.device import resolve_device
from core.errors import PolyfieldError, TrainingFailed
from core.evaluation import evaluate
from core.metrics import psnr
from core.presets import PRESETS, Settings, settings_for
from core.reconstruct import reconstruct
from exporters.gltf import read_glb, write_glb
from service.conversion import SCENE

RESULTS = Path(__file__).parent / "results"
JSON_FILE, TABLE_FILE = "train.json", "train.md"
PAPER = "the paper's setting"
CURVE_VIEWS = 4
PAPER_POINTS = 6  # of its curve
PAPER_PIXELS = {"cpu": 512, "cuda": 16384}  # a point of its curve is measured on
HEADING = """# Quality against training time

Made by `python -m benchmarks.train`. PSNR and SSIM are of the written .glb, read again, over all held-out views;
seconds are of training and baking, without reading photos, compiling kernels and measuring. "The paper's setting" is
its own networks and schedule in plain PyTorch (`benchmarks/reference_setting`), given that time for training. Charts
lie beside this table: a curve is measured while training (4 held-out views; the paper's setting: random held-out
pixels), its dot is the asset.
"""
COLUMNS = ("capture", "setting", "hardware", "PSNR dB", "SSIM", "seconds", ".glb MB", "quads", "peak MB", "on GPU MB")


@dataclass(frozen=True)
class TrainRow:
    """One setting on one capture. `glb_bytes` is 0 where training came out empty: then PSNR is the background's."""

    capture: str
    setting: str
    hardware: str
    psnr: float
    ssim: float | None
    seconds: float
    glb_bytes: int
    quads: int
    peak_bytes: int
    gpu_bytes: int
    notes: str
    curve: tuple[dict[str, Any], ...]

    def cells(self) -> tuple[str, ...]:
        return (
            self.capture, f"{self.setting} {self.notes}".strip(), self.hardware, figure(self.psnr),
            figure(self.ssim, ".4f"), figure(self.seconds, ".0f"), figure(self.glb_bytes / 1e6, ".1f"),
            str(self.quads), figure(self.peak_bytes / 1e6, ".0f"), figure(self.gpu_bytes / 1e6, ".0f"),
        )  # fmt: skip


def train_ours(path: Path, photos: dict[str, Any], settings: Settings, device: str, seed: int) -> TrainRow:
    """One of our settings."""
    capture = read_photos(path, photos)
    _compile_kernels(capture, settings, device)
    with Watch(_spread(capture, CURVE_VIEWS), device).attached() as watch:
        trained = reconstruct(capture, settings, device=device, seed=seed)
    seconds = sum(trained.seconds.values()) - watch.paused_s
    return _row(path, settings.preset, trained.scene, capture, device, seconds, watch.points, watch.gpu_bytes)


def train_paper(
    path: Path, photos: dict[str, Any], setting: PaperSetting, budget_s: float, device: str, seed: int
) -> TrainRow:
    """The paper's setting, for a given time; on a GPU with TensorFloat-32, which its authors' did not have."""
    torch.set_float32_matmul_precision("high")
    capture = read_photos(path, photos)
    run, points = PaperRun(capture, setting, device=device, seed=seed), []
    pixels, gpu_bytes = PAPER_PIXELS[device.partition(":")[0]], 0

    def watch(run: PaperRun, moment: Moment) -> None:
        nonlocal gpu_bytes
        if moment.share >= (len(points) + 1) / PAPER_POINTS:
            points.append(CurvePoint(moment.seconds, run.held_out_psnr(moment, pixels), f"stage {moment.stage}"))
            gpu_bytes = max(gpu_bytes, gpu_memory_bytes(device))

    run.train(budget_s, watch)
    started, scene = time.monotonic(), None
    with suppress(TrainingFailed):
        scene = bake_paper(run)
    seconds = run.seconds + time.monotonic() - started
    notes = f"(P {setting.cells}, K {setting.patch}, {'pruned' if setting.prune else 'not pruned'}, {run.steps} steps)"
    row = _row(path, PAPER, scene, capture, device, seconds, points, gpu_bytes)
    return replace(row, notes=notes if scene else f"{notes}: an empty scene")


def _row(
    path: Path,
    setting: str,
    scene: BakedScene | None,
    capture: Capture,
    device: str,
    seconds: float,
    points: list[CurvePoint],
    gpu_bytes: int,
) -> TrainRow:
    peak = peak_memory_bytes()  # of training: measuring comes after
    curve = tuple(asdict(point) for point in points)
    common = {"capture": path.resolve().stem, "setting": setting, "hardware": hardware(device), "seconds": seconds,
              "peak_bytes": peak, "gpu_bytes": gpu_bytes, "notes": "", "curve": curve}  # fmt: skip
    if scene is None:
        return TrainRow(psnr=_empty_psnr(capture), ssim=None, glb_bytes=0, quads=0, **common)
    glb = write_glb(scene)[SCENE]
    score = evaluate(read_glb(glb), capture.test, device=device)
    return TrainRow(psnr=score.psnr or 0.0, ssim=score.ssim, glb_bytes=len(glb), quads=scene.quad_count, **common)


def _empty_psnr(capture: Capture) -> float:
    background = np.asarray(capture.background, np.float32)
    photos = [(view.over(capture.background), view.ignored) for view in capture.test]
    return float(np.mean([psnr(photo, np.broadcast_to(background, photo.shape), mask) for photo, mask in photos]))


def _spread(capture: Capture, count: int) -> list[Any]:
    """`count` of the held-out views, evenly spread."""
    return [capture.test[i] for i in np.unique(np.linspace(0, len(capture.test) - 1, count).round().astype(int))]


def _compile_kernels(capture: Capture, settings: Settings, device: str) -> None:
    """A training of a few steps: what is set up on first use is not training time."""
    few = replace(settings, voxel_steps=8, field_steps=4, texel_steps=4, cells=16, nodes=24)
    with suppress(TrainingFailed):
        reconstruct(capture, few, device=device)


def write_results(folder: Path, rows: list[TrainRow]) -> None:
    """The table, and the chart of the rows' capture and device."""
    everything = merged(
        folder / JSON_FILE,
        [asdict(row) for row in rows],
        lambda row: (row["capture"], row["setting"], row["hardware"]),
    )
    known = [TrainRow(**row) for row in everything]
    table = markdown(COLUMNS, [row.cells() for row in known])
    (folder / TABLE_FILE).write_text(f"{HEADING}\n{table}", encoding="utf-8")
    for capture, machine in {(row.capture, row.hardware) for row in rows}:
        same = [row for row in known if (row.capture, row.hardware) == (capture, machine)]
        curves = [_curve(row) for row in same]
        kind = "gpu" if ";" in machine else "cpu"
        draw_chart(folder / f"train-{capture}-{kind}.png", f"{capture}, {machine}", curves)


def _curve(row: TrainRow) -> Curve:
    points = [CurvePoint(**point) for point in row.curve]
    return Curve(row.setting, points, (row.seconds, row.psnr) if row.glb_bytes else None)


def main() -> int:
    arguments = _arguments()
    rows = []
    try:
        for row in _measured(arguments, resolve_device(arguments.device)):
            print(f"{row.setting}: {row.psnr:.2f} dB in {row.seconds:.0f} s", flush=True)
            rows.append(row)
            write_results(arguments.results, [row])
    except PolyfieldError as error:
        sys.exit(f"error [{error.code}]: {error}")
    print(markdown(COLUMNS, [row.cells() for row in rows]))
    return 0


def _measured(arguments: argparse.Namespace, device: str) -> Iterator[TrainRow]:
    photos = photo_options_of(arguments)
    overrides = dict(text.split("=", 1) for text in arguments.set)
    for preset in arguments.presets:
        settings = settings_for(preset, **overrides)
        yield in_child(train_ours, arguments.capture, photos, settings, device, arguments.seed)
    if arguments.reference_seconds:
        setting = _paper_setting(arguments, device)
        job = (arguments.capture, photos, setting, arguments.reference_seconds, device, arguments.seed)
        yield in_child(train_paper, *job)


def _paper_setting(arguments: argparse.Namespace, device: str) -> PaperSetting:
    given = {name: getattr(arguments, f"reference_{name}") for name in ("cells", "patch", "batch")}
    chosen = {name: value for name, value in given.items() if value is not None}
    base = ON_A_CPU if device == "cpu" else PaperSetting()
    return replace(base, prune=arguments.reference_pruning, **chosen)


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("capture", type=Path, help="with held-out views")
    parser.add_argument("--presets", nargs="*", choices=list(PRESETS), default=["draft", "balanced"])
    parser.add_argument("--set", action="append", default=[], metavar="NAME=VALUE", help="a setting of all presets")
    parser.add_argument("--reference-seconds", type=float, default=0.0, help="train the paper's setting, too, so long")
    parser.add_argument("--reference-cells", type=int, help="its P; default: 128 on a GPU, 32 on a CPU")
    parser.add_argument("--reference-patch", type=int, help="its K; default: 17 on a GPU, 5 on a CPU")
    parser.add_argument("--reference-batch", type=int, help="its rays a step; default: 8192 on a GPU, 512 on a CPU")
    parser.add_argument(
        "--reference-pruning",
        action="store_true",
        help="prune by its acceleration grid, as in the paper; in minutes, that leaves an empty scene",
    )
    parser.add_argument("--device", default="auto")
    parser.add_argument("--seed", type=int, default=0)
    add_photo_options(parser)
    parser.add_argument("--results", type=Path, default=RESULTS, help="folder of the table and the charts")
    return parser.parse_args()


if __name__ == "__main__":
    sys.exit(main())
