"""Seconds and memory that each format takes for the largest scenes: 220,000 triangles on four pages of 4096².

    python -m benchmarks.export [FORMAT ...] [--scene scene.glb]

Each row is a process of its own that has the scene in memory and writes the file's bytes. Memory is the most it has
held at any time, scene, libraries and interpreter included. Rows go into export.json and export.md. The exit status is
1 where a format takes more than 20 s or 3 GiB.
"""

import argparse
import gc
import sys
import time
from collections import Counter
from dataclasses import asdict, dataclass
from pathlib import Path

from benchmarks.big_scene import big_scene
from benchmarks.child_process import in_child, peak_memory_bytes
from benchmarks.hardware import hardware
from benchmarks.tables import markdown, merged
from core.baked import BakedScene
from service.formats import FORMATS, formats_of
from service.formats.source import Source

RESULTS = Path(__file__).parent / "results"
JSON_FILE, TABLE_FILE = "export.json", "export.md"
MOST_S, MOST_BYTES = 20.0, 3 << 30
HEADING = """# Exporting the largest scenes

Made by `python -m benchmarks.export`: see there. The goal is 20 s and 3 GiB on two cores.
"""
COLUMNS = ("scene", "hardware", "format", "seconds", "CPU s", "peak GiB", "MB written", "goal")


@dataclass(frozen=True)
class ExportRow:
    """One format. `seconds` and `cpu_s` are of writing alone, `peak_bytes` is of the whole process."""

    scene: str
    hardware: str
    format: str
    seconds: float
    cpu_s: float
    peak_bytes: int
    written_bytes: int

    @property
    def goal_met(self) -> bool:
        return self.seconds <= MOST_S and self.peak_bytes <= MOST_BYTES

    def cells(self) -> tuple[str, ...]:
        return (
            self.scene, self.hardware, self.format, f"{self.seconds:.1f}", f"{self.cpu_s:.1f}",
            f"{self.peak_bytes / (1 << 30):.2f}", f"{self.written_bytes / 1e6:.1f}",
            "met" if self.goal_met else "missed",
        )  # fmt: skip


def measured(name: str, scene_file: Path | None) -> ExportRow:
    """Writes one format, in this process."""
    scene = _scene(scene_file)
    sizes = Counter("{1} x {0}".format(*page.features_u8.shape) for page in scene.pages)
    pages = ", ".join(f"{count} of {size} texels" for size, count in sizes.items())
    about = f"{scene.triangle_count} triangles; pages: {pages}"
    gc.collect()
    started, busy = time.perf_counter(), time.process_time()
    data = FORMATS[name].write(Source(scene))
    seconds, cpu_s = time.perf_counter() - started, time.process_time() - busy
    return ExportRow(about, hardware("cpu"), name, seconds, cpu_s, peak_memory_bytes(), len(data))


def _scene(file: Path | None) -> BakedScene:
    if file is None:
        return big_scene()
    from exporters.gltf import read_glb

    return read_glb(file.read_bytes())


def table(rows: list[ExportRow]) -> str:
    """Markdown."""
    return f"{HEADING}\n{markdown(COLUMNS, [row.cells() for row in rows])}"


def write_results(folder: Path, rows: list[ExportRow]) -> None:
    """Rows in place of those of the same scene, hardware and format."""
    everything = merged(
        folder / JSON_FILE, [asdict(row) for row in rows], lambda row: (row["scene"], row["hardware"], row["format"])
    )
    (folder / TABLE_FILE).write_text(table([ExportRow(**row) for row in everything]), encoding="utf-8")


def main() -> int:
    arguments = _arguments()
    rows = []
    for name in formats_of(arguments.formats or "all"):
        rows.append(in_child(measured, name, arguments.scene))
        print("  ".join(rows[-1].cells()[2:]), flush=True)
        write_results(arguments.results, rows)
    return 0 if all(row.goal_met for row in rows) else 1


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("formats", nargs="*", help="names of formats; all of them without")
    parser.add_argument("--scene", type=Path, help="a .glb in place of the made one")
    parser.add_argument("--results", type=Path, default=RESULTS)
    return parser.parse_args()


if __name__ == "__main__":
    sys.exit(main())
