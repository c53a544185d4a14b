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
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from benchmarks.hardware import hardware
from benchmarks.photo_options import add_photo_options, photo_options_of, read_photos
from benchmarks.tables import figure, markdown, merged
from benchmarks.uniform_layout import PAPER_K, watched_for_uniform_layout
from core.baked import BakedScene
from core.capture import View
from core.device import resolve_device
from core.errors import PolyfieldError
from core.evaluation import evaluate
from core.presets import settings_for
from core.reconstruct import reconstruct
from exporters.gltf import read_glb, write_glb, write_lq_glb, write_web_glb
from exporters.mobilenerf import read_mobilenerf, write_mobilenerf
from exporters.usd import read_usd, write_usd
from exporters.viewer import write_viewer_html, write_viewer_zip

RESULTS = Path(__file__).parent / "results"
JSON_FILE, TABLE_FILE = "size.json", "size.md"
UNIFORM, PLAIN = f"uniform K = {PAPER_K}, PNG", "scene.glb"
# Of the paper's bytes; dB below scene.glb.
GOALS = {"scene.web.glb": (0.40, 0.2), "scene.lq.glb": (0.15, 1.5)}
HEADING = f"""# Sizes

Made by `python -m benchmarks.size`. "{UNIFORM}" is the paper's layout of the same trained field (see
benchmarks/uniform_layout.py), written as plain .glb. PSNR is of the written files, read again, on the held-out views;
"of paper" is bytes against that layout's. s is wall clock of writing.
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

Files = Mapping[str, bytes]


class Deliverable(NamedTuple):
    """`read` is None where what is written holds a .glb that is measured by itself."""

    name: str
    write: Callable[[BakedScene], Files]
    read: Callable[[Files], BakedScene] | None


def _only(files: Files) -> bytes:
    (data,) = files.values()
    return data


def _glb(name: str, write: Callable[[BakedScene], Files]) -> Deliverable:
    return Deliverable(name, write, lambda files: read_glb(_only(files)))


DELIVERABLES = (
    _glb(PLAIN, write_glb),
    _glb("scene.web.glb", write_web_glb),
    _glb("scene.lq.glb", write_lq_glb),
    Deliverable("viewer.zip", lambda scene: write_viewer_zip(_only(write_web_glb(scene))), None),
    Deliverable("viewer.html", lambda scene: write_viewer_html(_only(write_web_glb(scene))), None),
    Deliverable("MobileNeRF's layout", write_mobilenerf, read_mobilenerf),
    Deliverable("neural USD", write_usd, read_usd),
)


@dataclass(frozen=True)
class SizeRow:
    """One deliverable of one scene. `base` says of which: capture, preset and hardware.

    Attributes:
        psnr: mean over the held-out views; None where it is another's.
        texels: of all pages.
    """

    base: str
    name: str
    bytes: int
    psnr: float | None
    quads: int
    texels: int
    pages: int
    seconds: float


def measured(base: str, one: Deliverable, scene: BakedScene, views: tuple[View, ...], device: str) -> SizeRow:
    """Writes, reads and renders a deliverable."""
    started = time.perf_counter()
    files = one.write(scene)
    seconds = time.perf_counter() - started
    held = one.read(files) if one.read else scene
    quality = evaluate(held, in_frame_of(views, scene, held), device=device).psnr if one.read else None
    texels = sum(page.features_u8.shape[0] * page.features_u8.shape[1] for page in held.pages)
    size = sum(len(data) for data in files.values())
    return SizeRow(base, one.name, size, quality, held.quad_count, texels, len(held.pages), seconds)


def in_frame_of(views: tuple[View, ...], scene: BakedScene, held: BakedScene) -> tuple[View, ...]:
    """Views of `scene` as views of `held`, whose object frame may have another place and size, but is not turned.

    A layout that keeps no cameras keeps no frames, either, and leaves the object's as it was.
    """
    if not held.cameras:
        return views
    held_from_asset = np.linalg.inv(held.asset_from_object)
    return tuple(_moved(view, held_from_asset @ scene.asset_from_object) for view in views)


def _moved(view: View, held_from_scene: np.ndarray) -> View:
    pose = held_from_scene @ view.camera.world_from_camera
    pose[:3, :3] = view.camera.world_from_camera[:3, :3]
    return replace(view, camera=replace(view.camera, world_from_camera=pose))


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
    return (
        row.name, figure(row.bytes / 1e6), f"{100 * share:.1f} %", figure(row.psnr), figure(loss and -loss, "+.2f"),
        f"{100 * goal[0]:.0f} %, -{goal[1]} dB: {'met' if goal_met(row, known) else 'missed'}" if goal else "",
        str(row.quads), figure(row.texels / 1e6), str(row.pages), figure(row.seconds, ".1f"),
    )  # fmt: skip


def share_and_loss(row: SizeRow, known: Mapping[str, SizeRow]) -> tuple[float, float | None]:
    """(bytes of the paper's, dB below scene.glb)."""
    plain = known[PLAIN].psnr
    return row.bytes / known[UNIFORM].bytes, plain - row.psnr if plain is not None and row.psnr is not None else None


def goal_met(row: SizeRow, known: Mapping[str, SizeRow]) -> bool:
    share, loss = share_and_loss(row, known)
    most_share, most_loss = GOALS.get(row.name, (float("inf"), float("inf")))
    return share <= most_share and (loss is None or loss <= most_loss)


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
    assert layout.scene is not None
    base = ", ".join([arguments.capture.resolve().stem, arguments.preset, *arguments.set, hardware(device)])
    rows = []
    for one, source in ((_glb(UNIFORM, write_glb), layout.scene), *((one, scene) for one in DELIVERABLES)):
        rows.append(measured(base, one, source, capture.test, device))
        print(f"{rows[-1].bytes / 1e6:8.2f} MB  {figure(rows[-1].psnr):>6} dB  {one.name}", flush=True)
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
