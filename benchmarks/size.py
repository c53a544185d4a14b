"""Bytes and quality of every deliverable, beside the paper's layout of the same trained field.

    python -m benchmarks.size CAPTURE [--preset draft] [--set NAME=VALUE ...] [--device auto]

Trains once. The paper's layout is K = 17 texels a side for every quad, in plain PNG, baked from the field as it is when
our texels begin to be trained. Quality is of the written files, read again, on the held-out views. Rows go into
size.json and size.md. The exit status is 1 where a goal is missed: scene.web.glb at most 40 % of the paper's bytes and
0.2 dB below scene.glb, scene.lq.glb at most 15 % and 1.5 dB.
"""

import argparse
import sys
import time
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path

from benchmarks.hardware import hardware
from benchmarks.photo_options import add_photo_options, photo_options_of, read_photos
from benchmarks.tables import figure, markdown, merged
from benchmarks.uniform_layout import PAPER_K, watched_for_uniform_layout
from core.baked import BakedScene
from core.device import resolve_device
from core.errors import PolyfieldError
from core.presets import settings_for
from core.reconstruct import reconstruct
from service.formats import FORMATS, Format
from service.formats.measure import Measure
from service.formats.source import Source

RESULTS = Path(__file__).parent / "results"
JSON_FILE, TABLE_FILE = "size.json", "size.md"
UNIFORM, PLAIN = f"uniform K = {PAPER_K}, PNG", FORMATS["glb"].file
# Of the paper's bytes; dB below scene.glb.
GOALS = {FORMATS["web"].file: (0.40, 0.2), FORMATS["lq"].file: (0.15, 1.5)}
HEADING = f"""# Sizes

Made by `python -m benchmarks.size`. "{UNIFORM}" is the paper's layout of the same trained field (see
benchmarks/uniform_layout.py), written as plain .glb. PSNR is of the written files, read again, on the held-out views;
of Quick Look, OBJ and PLY it is that of their baked colours. "of paper" is bytes against the paper's layout's. s is
wall clock of writing; the viewers' is of packing scene.web.glb.
"""
COLUMNS = (
    "file",
    "MB",
    "of paper",
    "PSNR dB",
    "against scene.glb",
    "goal",
    "quads",
    "Mtexels",
    "pages",
    "written in s",
)


@dataclass(frozen=True)
class SizeRow:
    """One deliverable of one scene. `base` says of which: capture, preset and hardware.

    Attributes:
        psnr: mean over the held-out views.
        quads: half the triangles.
        texels: of all pages.
    """

    base: str
    name: str
    bytes: int
    psnr: float
    quads: int
    texels: int
    pages: int
    seconds: float


def measured(base: str, name: str, one: Format, source: Source, measure: Measure) -> SizeRow:
    """Writes, reads and renders a deliverable."""
    started = time.perf_counter()
    data = one.write(source)
    seconds = time.perf_counter() - started
    held = one.read(data)
    scene = held if isinstance(held, BakedScene) else held.scene
    texels = sum(page.features_u8.shape[0] * page.features_u8.shape[1] for page in scene.pages)
    quality = measure.psnr(held, source.scene)
    return SizeRow(base, name, len(data), quality, scene.quad_count, texels, len(scene.pages), seconds)


def table(rows: list[SizeRow]) -> str:
    """Markdown, a table for each base."""
    parts = [HEADING]
    for base in dict.fromkeys(row.base for row in rows):
        known = {row.name: row for row in rows if row.base == base}
        parts.append(f"## {base}\n\n{markdown(COLUMNS, [_cells(row, known) for row in known.values()])}")
    return "\n".join(parts)


def _cells(row: SizeRow, known: Mapping[str, SizeRow]) -> tuple[str, ...]:
    share, loss = share_and_loss(row, known)
    goal = GOALS.get(row.name)
    gain = figure(round(-loss, 2) + 0.0, "+.2f")  # + 0.0: no negative zero
    return (
        row.name, figure(row.bytes / 1e6), f"{100 * share:.1f} %", figure(row.psnr), gain,
        f"{100 * goal[0]:.0f} %, -{goal[1]} dB: {'met' if goal_met(row, known) else 'missed'}" if goal else "",
        str(row.quads), figure(row.texels / 1e6), str(row.pages), figure(row.seconds, ".1f"),
    )  # fmt: skip


def share_and_loss(row: SizeRow, known: Mapping[str, SizeRow]) -> tuple[float, float]:
    """(bytes of the paper's, dB below scene.glb)."""
    return row.bytes / known[UNIFORM].bytes, known[PLAIN].psnr - row.psnr


def goal_met(row: SizeRow, known: Mapping[str, SizeRow]) -> bool:
    share, loss = share_and_loss(row, known)
    most_share, most_loss = GOALS.get(row.name, (float("inf"), float("inf")))
    return share <= most_share and loss <= most_loss


def main() -> int:
    arguments = _arguments()
    try:
        device = resolve_device(arguments.device)
        settings = settings_for(arguments.preset, **dict(text.split("=", 1) for text in arguments.set))
        capture = read_photos(arguments.capture, photo_options_of(arguments))
        with watched_for_uniform_layout(capture) as layout:
            scene = reconstruct(capture, settings, device=device, seed=arguments.seed).scene
    except PolyfieldError as error:
        sys.exit(f"error [{error.code}]: {error}")
    measure = Measure.on(capture, scene.background, device)
    assert layout.scene is not None
    if measure is None:
        sys.exit("error: the capture must hold out views to measure on")
    base = ", ".join([arguments.capture.resolve().stem, arguments.preset, *arguments.set, hardware(device)])
    source = Source(scene)
    everything = [(UNIFORM, FORMATS["glb"], Source(layout.scene))]
    everything += [(one.file, one, source) for one in FORMATS.values()]
    rows = []
    for name, one, made_of in everything:
        rows.append(measured(base, name, one, made_of, measure))
        print(f"{rows[-1].bytes / 1e6:8.2f} MB  {figure(rows[-1].psnr):>6} dB  {name}", flush=True)
    write_results(arguments.results, rows)
    known = {row.name: row for row in rows}
    return 0 if all(goal_met(row, known) for row in rows) else 1


def write_results(folder: Path, rows: list[SizeRow]) -> None:
    everything = merged(folder / JSON_FILE, [asdict(row) for row in rows], lambda row: (row["base"], row["name"]))
    (folder / TABLE_FILE).write_text(table([SizeRow(**row) for row in everything]), encoding="utf-8")


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("capture", type=Path, help="with held-out views")
    parser.add_argument("--preset", default="draft")
    parser.add_argument("--set", action="append", default=[], metavar="NAME=VALUE", help="a setting of the preset")
    parser.add_argument("--device", default="auto")
    parser.add_argument("--seed", type=int, default=0)
    add_photo_options(parser)
    parser.add_argument("--results", type=Path, default=RESULTS)
    return parser.parse_args()


if __name__ == "__main__":
    sys.exit(main())
