"""What is reported of a conversion."""

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from typing import Any, TypeAlias

from service.formats import FORMATS, FormatRow

PLAIN_FILES = ("scene.glb", "preview.png")  # the sizes of all others are in the table of formats

ByteString: TypeAlias = bytes  # Report has a field of that name


def json_bytes(value: Mapping[str, Any]) -> ByteString:
    """A JSON file."""
    return json.dumps(value, indent=2, allow_nan=False).encode()


@dataclass(frozen=True)
class Figure:
    """A quality measure over the held-out views.

    Attributes:
        mean: over the views; None where none is held out.
        per_view: view name to value.
    """

    mean: float | None
    per_view: Mapping[str, float]


@dataclass(frozen=True)
class Report:
    """The figures of a conversion, all measured on the written scene.glb after reading it again.

    Attributes:
        psnr, ssim: on the held-out views; dB, and [-1, 1].
        seconds: stage to wall clock seconds, of an interrupted run too; `total` is their sum.
        bytes: artefact to its size.
        quads, triangles, pages: of the scene.
        settings: the preset with its overrides, seed and sizes: all that is needed to do it again.
        device: that trained it, cpu or cuda:N.
        views: photos trained on and held out.
        notes: remarks for the user.
        capture: the capture report, as in capture.json.
        formats: name to what was exported, scene.glb included, or why it is missing.
    """

    psnr: Figure
    ssim: Figure
    seconds: Mapping[str, float]
    bytes: Mapping[str, int]
    quads: int
    triangles: int
    pages: int
    settings: Mapping[str, Any]
    device: str
    views: Mapping[str, int]
    notes: tuple[str, ...]
    capture: Mapping[str, Any] = field(default_factory=dict)
    formats: Mapping[str, FormatRow] = field(default_factory=dict)

    @classmethod
    def from_bytes(cls, data: ByteString) -> "Report":
        """The reverse of `as_bytes`."""
        value = json.loads(data)
        figures = {name: Figure(**value[name]) for name in ("psnr", "ssim")}
        rows = {name: FormatRow(**row) for name, row in value.get("formats", {}).items()}
        return cls(**{**value, **figures, "notes": tuple(value["notes"]), "formats": rows})

    def with_format(self, name: str, row: FormatRow) -> "Report":
        """The report with one format more, or anew."""
        sizes = {**self.bytes, row.file: row.bytes}
        rows = {**self.formats, name: row}
        there = {file: size for file, size in sizes.items() if size is not None}
        return replace(self, bytes=there, formats={known: rows[known] for known in FORMATS if known in rows})

    def with_seconds(self, stage: str, seconds: float) -> "Report":
        """The report with a stage that took so much longer."""
        stages = {name: value for name, value in self.seconds.items() if name != "total"}
        stages[stage] = stages.get(stage, 0.0) + seconds
        return replace(self, seconds=stages | {"total": sum(stages.values())})

    def as_bytes(self) -> ByteString:
        """report.json."""
        return json_bytes(asdict(self))

    def as_table(self) -> str:
        """For a terminal."""
        seconds = ", ".join(f"{stage} {value:.1f}" for stage, value in self.seconds.items())
        plain = {file: size for file, size in self.bytes.items() if file in PLAIN_FILES}
        sizes = ", ".join(f"{file} {size / 1e6:.2f} MB" for file, size in plain.items())
        rows = {
            "PSNR": _quality(self.psnr, "{:.2f} dB"),
            "SSIM": _quality(self.ssim, "{:.4f}"),
            "size": sizes,
            "quads": f"{self.quads} ({self.triangles} triangles, {self.pages} texture pages)",
            "seconds": seconds,
            "device": self.device,
        }
        lines = [f"{name:<8} {value}" for name, value in rows.items()]
        lines += ["", format_table(self.formats)] if len(self.formats) > 1 else []
        return "\n".join(lines + [f"note: {note}" for note in self.notes])


def format_table(rows: Mapping[str, FormatRow]) -> str:
    """For a terminal: a line for each format."""
    cells = [("format", "file", "MB", "PSNR dB", "s", "")]
    for name, row in rows.items():
        size = "" if row.bytes is None else f"{row.bytes / 1e6:.2f}"
        quality = "" if row.psnr is None else f"{row.psnr:.2f}"
        remark = f"missing: {row.problem}" if row.problem else row.note
        cells.append((name, row.file, size, quality, f"{row.seconds:.1f}", remark))
    widths = [max(len(line[column]) for line in cells) for column in range(5)]
    return "\n".join(
        f"{line[0]:<{widths[0]}}  {line[1]:<{widths[1]}}  {line[2]:>{widths[2]}}  {line[3]:>{widths[3]}}  "
        f"{line[4]:>{widths[4]}}  {line[5]}".rstrip()
        for line in cells
    )


def _quality(figure: Figure, form: str) -> str:
    if figure.mean is None:
        return "not measured: no held-out view"
    count = len(figure.per_view)
    return f"{form.format(figure.mean)} over {count} held-out view{'s' if count > 1 else ''}"
