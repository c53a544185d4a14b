"""The table of measured conversions: convert.json for programs, convert.md for people."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

JSON_FILE, TABLE_FILE = "convert.json", "convert.md"
HEADING = """# Conversions

Made by `python -m benchmarks.convert`: quality of the written .glb, read again, on the held-out views. "Total" is wall
clock from the first photo read to the last file written; "CPU" is what all cores together worked for it, and says how
busy the machine was with other things. Where a goal is set, it stands behind the figure.
"""
COLUMNS = ("name", "hardware", "PSNR dB", "SSIM", ".glb MB", "quads", "seconds per stage", "total s", "CPU s")


@dataclass(frozen=True)
class ConvertRow:
    """One conversion.

    Attributes:
        overrides: settings that were not the preset's.
        psnr, ssim: means over the held-out views; None without any.
        seconds: per stage, wall clock.
        total_s, cpu_s: of the whole; wall clock, and CPU time of all threads.
        goal_psnr, goal_s: least PSNR and most seconds that were asked for.
    """

    name: str
    preset: str
    overrides: Mapping[str, float]
    hardware: str
    device: str
    views: Mapping[str, int]
    psnr: float | None
    ssim: float | None
    glb_bytes: int
    quads: int
    pages: int
    seconds: Mapping[str, float]
    total_s: float
    cpu_s: float
    goal_psnr: float | None = None
    goal_s: float | None = None

    @property
    def goals_met(self) -> bool:
        quality_ok = self.goal_psnr is None or (self.psnr is not None and self.psnr >= self.goal_psnr)
        return quality_ok and (self.goal_s is None or self.total_s <= self.goal_s)

    def cells(self) -> tuple[str, ...]:
        """One text per column."""
        stages = ", ".join(f"{stage} {seconds:.1f}" for stage, seconds in self.seconds.items())
        return (
            self.name,
            self.hardware,
            _figure(self.psnr, ".2f") + _goal("at least", self.goal_psnr),
            _figure(self.ssim, ".4f"),
            f"{self.glb_bytes / 1e6:.2f}",
            str(self.quads),
            stages,
            f"{self.total_s:.0f}" + _goal("at most", self.goal_s),
            f"{self.cpu_s:.0f}",
        )

    def as_text(self) -> str:
        """For a terminal."""
        lines = [f"{name:<18} {cell}" for name, cell in zip(COLUMNS, self.cells(), strict=True)]
        return "\n".join(lines if self.goals_met else [*lines, "A goal was missed."])


def add_row(folder: Path, row: ConvertRow) -> None:
    """Writes the row in place of the one with its name and hardware, if any."""
    path = folder / JSON_FILE
    rows: list[dict[str, Any]] = json.loads(path.read_text(encoding="utf-8")) if path.exists() else []
    rows = [old for old in rows if (old["name"], old["hardware"]) != (row.name, row.hardware)]
    rows = sorted([*rows, asdict(row)], key=lambda one: (one["name"], one["hardware"]))
    path.write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")
    (folder / TABLE_FILE).write_text(table([ConvertRow(**one) for one in rows]), encoding="utf-8")


def table(rows: Sequence[ConvertRow]) -> str:
    """Markdown."""
    lines = ["| " + " | ".join(COLUMNS) + " |", "| --- " * len(COLUMNS) + "|"]
    lines += ["| " + " | ".join(row.cells()) + " |" for row in rows]
    return HEADING + "\n" + "\n".join(lines) + "\n"


def _figure(value: float | None, form: str) -> str:
    return "not measured" if value is None else format(value, form)


def _goal(words: str, value: float | None) -> str:
    return "" if value is None else f" ({words} {value:g})"
