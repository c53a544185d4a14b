"""What each part of the method is worth: the paper's Table 6, here.

    python -m benchmarks.ablate CAPTURE [--preset draft] [--set NAME=VALUE ...] [--rows WORD ...] [--device auto]

Trains the full method and then once for each row of benchmarks/ablations.py, with the same seed and in a process of its
own. Figures are of the written .glb, read again, on the held-out views. Rows go into ablate.json and ablate.md; with
--rows, only those whose name contains one of the words are trained again.
"""

import argparse
import sys
import time
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.ablations import ABLATIONS, FULL, Ablation
from benchmarks.child_process import in_child, peak_memory_bytes
from benchmarks.hardware import hardware
from benchmarks.photo_options import add_photo_options, photo_options_of, read_photos
from benchmarks.tables import figure, markdown, merged
from core.baked import BakedScene
from core.capture import View
from core.device import resolve_device
from core.errors import PolyfieldError
from core.evaluation import evaluate
from core.metrics import psnr
from core.presets import Settings, settings_for
from core.reconstruct import reconstruct
from core.render.composite import over, quantised
from core.render.raster import Rasteriser
from exporters.gltf import read_glb, write_glb
from service.conversion import SCENE

RESULTS = Path(__file__).parent / "results"
JSON_FILE, TABLE_FILE = "ablate.json", "ablate.md"
# Under a minute a row on two cores for lego at 100 px.
SMALL = {"cells": 48, "nodes": 80, "voxel_steps": 500, "field_steps": 200, "texel_steps": 400}
SAME = 0.05  # dB: less than this is no difference
HEADING = """# Ablations

Made by `python -m benchmarks.ablate`: the paper's Table 6 (Synthetic 360), the same taken away from Polyfield.
PSNR is of the written .glb, read again, on the held-out views; one seed, so differences below about 0.2 dB say little.
Delta is against the full method, for K = 9 and 33 against K = 17.
"""
COLUMNS = ("without", "PSNR dB", "delta", "paper's delta", "sign", "CPU s", ".glb MB", "quads", "why")


@dataclass(frozen=True)
class AblationRow:
    """One training. `base` says on what: capture, settings and hardware.

    `seconds` is what all cores together worked for it: unlike the wall clock it does not depend on what else ran.
    """

    name: str
    base: str
    psnr: float
    seconds: float
    glb_bytes: int
    quads: int
    peak_bytes: int


def train_row(name: str, path: Path, photos: dict[str, Any], base: Settings, device: str, seed: int) -> AblationRow:
    """Trains one row of the table."""
    ablation = next(one for one in ABLATIONS if one.name == name)
    capture = read_photos(path, photos)
    settings = replace(base, **ablation.settings(base))
    started = time.process_time()
    with ablation.within():
        trained = reconstruct(capture, settings, device=device, seed=seed)
    seconds = time.process_time() - started
    peak = peak_memory_bytes()
    glb = write_glb(trained.scene)[SCENE]
    scene = read_glb(glb)
    quality = (
        forward_psnr(scene, capture.test, device)
        if ablation.forward
        else evaluate(scene, capture.test, device=device).psnr
    )
    words = f"{path.resolve().stem}, {base_words(base)}, {hardware(device)}"
    return AblationRow(name, words, quality or 0.0, seconds, len(glb), scene.quad_count, peak)


def forward_psnr(scene: BakedScene, views: tuple[View, ...], device: str) -> float:
    """Mean PSNR (dB) of views drawn with one sample a pixel."""
    rasteriser, scores = Rasteriser(scene, device), []
    for view in views:
        drawn = quantised(over(rasteriser.forward(view.camera), scene.background)) / 255.0
        scores.append(psnr(view.over(scene.background), drawn, view.ignored))
    return float(np.mean(scores))


def base_words(settings: Settings) -> str:
    """The preset, and what differs from it."""
    standard = asdict(settings_for(settings.preset))
    changes = [f"{name} {value}" for name, value in asdict(settings).items() if value != standard[name]]
    return f"{settings.preset} ({', '.join(changes)})" if changes else settings.preset


def table(rows: list[AblationRow]) -> str:
    """Markdown, a table for each base."""
    parts = [HEADING]
    for base in dict.fromkeys(row.base for row in rows):
        known = {row.name: row for row in rows if row.base == base}
        lines = [_cells(one, known) for one in ABLATIONS if one.name in known]
        parts.append(f"## {base}\n\n{markdown(COLUMNS, lines)}")
    return "\n".join(parts)


def _cells(ablation: Ablation, known: dict[str, AblationRow]) -> tuple[str, ...]:
    row, other = known[ablation.name], known.get(ablation.against)
    delta = row.psnr - other.psnr if other and other is not row else None
    return (
        row.name, figure(row.psnr), figure(delta, "+.2f"), figure(ablation.paper_delta, "+.2f"),
        sign(delta, ablation.paper_delta), figure(row.seconds, ".0f"), figure(row.glb_bytes / 1e6, ".1f"),
        str(row.quads), ablation.why,
    )  # fmt: skip


def sign(delta: float | None, paper_delta: float | None) -> str:
    """Whether both changes have the same sign; one that is too small to tell agrees with none."""
    if delta is None or paper_delta is None:
        return ""
    if abs(delta) < SAME:
        return "no difference"
    return "same" if (delta > 0) == (paper_delta > 0) else "different"


def main() -> int:
    arguments = _arguments()
    names = [one.name for one in ABLATIONS if not arguments.rows or any(word in one.name for word in arguments.rows)]
    photos = photo_options_of(arguments)
    overrides = SMALL | dict(text.split("=", 1) for text in arguments.set)
    try:
        device, base = resolve_device(arguments.device), settings_for(arguments.preset, **overrides)
        for name in names:
            job = (name, arguments.capture, photos, base, device, arguments.seed)
            row = in_child(train_row, *job)
            print(f"{row.psnr:6.2f} dB {row.seconds:5.0f} CPU s  {name}", flush=True)
            write_results(arguments.results, [row])
    except PolyfieldError as error:
        sys.exit(f"error [{error.code}]: {error}")
    return 0


def write_results(folder: Path, rows: list[AblationRow]) -> None:
    everything = merged(folder / JSON_FILE, [asdict(row) for row in rows], lambda row: (row["base"], row["name"]))
    text = table([AblationRow(**row) for row in everything])
    (folder / TABLE_FILE).write_text(text, encoding="utf-8")


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("capture", type=Path, help="with held-out views")
    parser.add_argument("--preset", default="draft")
    parser.add_argument(
        "--set", action="append", default=[], metavar="NAME=VALUE",
        help=f"a setting of the base; without: {', '.join(f'{k}={v}' for k, v in SMALL.items())}",
    )  # fmt: skip
    parser.add_argument("--rows", nargs="+", default=[], help=f"words; e.g. {FULL!r}, 'K ='")
    parser.add_argument("--device", default="auto")
    parser.add_argument("--seed", type=int, default=0)
    add_photo_options(parser)
    parser.add_argument("--results", type=Path, default=RESULTS)
    return parser.parse_args()


if __name__ == "__main__":
    sys.exit(main())
