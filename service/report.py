"""What is reported of a conversion."""

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import Any, TypeAlias

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

    @classmethod
    def from_bytes(cls, data: ByteString) -> "Report":
        """The reverse of `as_bytes`."""
        value = json.loads(data)
        figures = {name: Figure(**value[name]) for name in ("psnr", "ssim")}
        return cls(**{**value, **figures, "notes": tuple(value["notes"])})

    def as_bytes(self) -> ByteString:
        """report.json."""
        return json_bytes(asdict(self))

    def as_table(self) -> str:
        """For a terminal."""
        seconds = ", ".join(f"{stage} {value:.1f}" for stage, value in self.seconds.items())
        sizes = ", ".join(f"{name} {size / 1e6:.2f} MB" for name, size in self.bytes.items())
        rows = {
            "PSNR": _quality(self.psnr, "{:.2f} dB"),
            "SSIM": _quality(self.ssim, "{:.4f}"),
            "size": sizes,
            "quads": f"{self.quads} ({self.triangles} triangles, {self.pages} texture pages)",
            "seconds": seconds,
            "device": self.device,
        }
        lines = [f"{name:<8} {value}" for name, value in rows.items()]
        return "\n".join(lines + [f"note: {note}" for note in self.notes])


def _quality(figure: Figure, form: str) -> str:
    if figure.mean is None:
        return "not measured: no held-out view"
    count = len(figure.per_view)
    return f"{form.format(figure.mean)} over {count} held-out view{'s' if count > 1 else ''}"
