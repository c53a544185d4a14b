"""The table of what was proved of each deliverable: formats.json for programs, formats.md for people."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, ClassVar

from benchmarks.tables import figure, markdown, merged
from tests.conformance.usd_validation import SUPPRESSED, SUPPRESSED_VALIDATOR
from tests.parity.compare import FLIPPED_SHARE, INTERIOR_DB

JSON_FILE, TABLE_FILE = "formats.json", "formats.md"
FALLBACK_DB = 24.0
HEADING = f"""# Every format of a scene

Made by `python -m benchmarks.formats`. Everything is measured on written files.

- Conformance: Khronos' glTF validator, OpenUSD's validators, and reading back.
- Parity: OpenGL runs the shaders that the file brings, or those that MaterialX makes of its nodes, or of a layout
  without any the extension's. Against the float64 reference renderer on the scene of the .glb; interior and flipped as
  tests/parity/compare.py has them, the worst of the views. "Quantised" files round features, so that 45 dB are enough.
- Fallbacks: drawn by OpenGL with four samples a pixel, against the held-out photos. The goal is for the mean;
  it was set for lego_400.

Of OpenUSD's validators all are asked. Errors of one, {SUPPRESSED_VALIDATOR}, are suppressed:

"""


@dataclass(frozen=True)
class ConformanceRow:
    """What a validator says of one file.

    Attributes:
        base: scene, capture, views and hardware.
        name: the file.
        by: the validator.
        suppressed: what is suppressed, to how often.
        problems: errors and warnings in words; the first ones.
    """

    kind: ClassVar[str] = "conformance"
    title: ClassVar[str] = "Conformance"
    columns: ClassVar[tuple[str, ...]] = ("file", "by", "errors", "warnings", "suppressed", "goal")
    base: str
    name: str
    by: str
    errors: int
    warnings: int
    suppressed: Mapping[str, int]
    problems: Sequence[str]

    @property
    def goal_met(self) -> bool:
        return self.errors == self.warnings == 0

    def cells(self) -> tuple[str, ...]:
        suppressed = ", ".join(f"{name} ({count})" for name, count in self.suppressed.items())
        return (self.name, self.by, str(self.errors), str(self.warnings), suppressed, _verdict("none", self.goal_met))


@dataclass(frozen=True)
class ParityRow:
    """How equal a file's drawing is to the reference; the worst of the views. dB; percent of the shown pixels."""

    kind: ClassVar[str] = "parity"
    title: ClassVar[str] = "Parity with the reference renderer"
    columns: ClassVar[tuple[str, ...]] = ("file", "drawn by", "interior dB", "flipped %", "goal")
    base: str
    name: str
    by: str
    interior_db: float
    flipped_percent: float
    goal_db: float = INTERIOR_DB
    goal_percent: float = 100 * FLIPPED_SHARE

    @property
    def goal_met(self) -> bool:
        return self.interior_db >= self.goal_db and self.flipped_percent <= self.goal_percent

    def cells(self) -> tuple[str, ...]:
        goal = _verdict(f"{self.goal_db:g} dB, {self.goal_percent:g} %", self.goal_met)
        return (self.name, self.by, figure(self.interior_db), figure(self.flipped_percent, ".3f"), goal)


@dataclass(frozen=True)
class FallbackRow:
    """PSNR against the photos, mean and worst of the views, dB. `goal_db` is for the mean; None for no goal."""

    kind: ClassVar[str] = "fallback"
    title: ClassVar[str] = "Fallbacks against the photos"
    columns: ClassVar[tuple[str, ...]] = ("file", "drawn by", "mean dB", "worst dB", "goal")
    base: str
    name: str
    by: str
    mean_db: float
    worst_db: float
    goal_db: float | None = FALLBACK_DB

    @property
    def goal_met(self) -> bool:
        return self.goal_db is None or self.mean_db >= self.goal_db

    def cells(self) -> tuple[str, ...]:
        goal = "" if self.goal_db is None else _verdict(f"{self.goal_db:g} dB", self.goal_met)
        return (self.name, self.by, figure(self.mean_db), figure(self.worst_db), goal)


FormatCheck = ConformanceRow | ParityRow | FallbackRow
KINDS: Mapping[str, Callable[..., FormatCheck]] = {row.kind: row for row in (ConformanceRow, ParityRow, FallbackRow)}


def write_results(folder: Path, rows: Sequence[FormatCheck]) -> None:
    """Rows in place of those of the same base, kind, file and way."""
    everything = merged(folder / JSON_FILE, [{"kind": row.kind, **asdict(row)} for row in rows], _key)
    (folder / TABLE_FILE).write_text(table([_row(values) for values in everything]), encoding="utf-8")


def table(rows: Sequence[FormatCheck]) -> str:
    """Markdown: for each base a table of each kind."""
    parts = [HEADING + "\n".join(f"- {name}: {reason}" for name, reason in SUPPRESSED.items()) + "\n"]
    for base in dict.fromkeys(row.base for row in rows):
        parts.append(f"## {base}\n")
        for kind in KINDS:
            of_kind = [row for row in rows if (row.base, row.kind) == (base, kind)]
            if of_kind:
                cells = [row.cells() for row in of_kind]
                parts.append(f"### {of_kind[0].title}\n\n{markdown(of_kind[0].columns, cells)}")
    return "\n".join(parts)


def _row(values: Mapping[str, Any]) -> FormatCheck:
    return KINDS[values["kind"]](**{name: value for name, value in values.items() if name != "kind"})


def _key(values: Mapping[str, Any]) -> tuple[str, ...]:
    return tuple(values[name] for name in ("base", "kind", "name", "by"))


def _verdict(goal: str, met: bool) -> str:
    return f"{goal}: {'met' if met else 'missed'}"
