"""What came of posing photos."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from core.errors import PosesNotFound
from core.posing.photo_set import MIN_PHOTOS

MAX_NAMED = 4
NO_DETAIL = "with hardly any detail, blank or far out of focus"
REMEDY = (
    "Photograph something with detail that stands still, each photo overlapping its neighbours by two thirds, and from "
    "another place; or add a pose file."
)


@dataclass(frozen=True)
class LeftOut:
    """A photo without a pose, and why."""

    name: str
    reason: str


@dataclass(frozen=True)
class Posing:
    """The outcome, also where it is no success.

    Attributes:
        folder: of the photos (`images`) and the COLMAP model (`sparse/0`); `core.datasets.read_capture` reads it.
        registered: names of the posed photos, sorted.
        left_out: the others, with reasons.
        cameras: number of lenses.
        points: number of sparse points.
        error_px: mean reprojection error of the points, in pixels of the photos.
        seconds: per stage (features, matching, mapping), of interrupted runs, too.
        notes: remarks for the user.
    """

    folder: Path
    registered: tuple[str, ...]
    left_out: tuple[LeftOut, ...]
    cameras: int = 0
    points: int = 0
    error_px: float = 0.0
    seconds: Mapping[str, float] = field(default_factory=dict)
    notes: tuple[str, ...] = ()

    @property
    def images(self) -> Path:
        """The folder that all readable photos are linked in, under their names."""
        return self.folder / "images"

    @property
    def is_usable(self) -> bool:
        return len(self.registered) >= MIN_PHOTOS

    @property
    def reasons(self) -> dict[str, tuple[str, ...]]:
        """Reason to the names of the photos left out for it, the most frequent first."""
        groups: dict[str, list[str]] = {}
        for photo in self.left_out:
            groups.setdefault(photo.reason, []).append(photo.name)
        ordered = sorted(groups.items(), key=lambda group: -len(group[1]))
        return {reason: tuple(names) for reason, names in ordered}

    @property
    def summary(self) -> str:
        """In one line: how many were posed, and why others were not."""
        total = len(self.registered) + len(self.left_out)
        left = [f"{len(names)} {reason} ({named(names)})" for reason, names in self.reasons.items()]
        posed = f"{len(self.registered)} of {total} photos posed"
        return f"{posed}: {'; '.join(left)}" if left else posed

    def require_usable(self) -> None:
        """Raises PosesNotFound unless at least `MIN_PHOTOS` photos are posed."""
        if not self.is_usable:
            rule = "must overlap and show enough detail for their cameras to be estimated"
            raise PosesNotFound("photos without poses", rule, self.summary, REMEDY)

    def as_json(self) -> dict[str, Any]:
        return {**asdict(self), "folder": str(self.folder)}

    @classmethod
    def from_json(cls, value: Mapping[str, Any], folder: Path) -> Posing:
        """The reverse of `as_json`, for a folder that may have moved."""
        left_out = tuple(LeftOut(**photo) for photo in value["left_out"])
        lists = {name: tuple(value[name]) for name in ("registered", "notes")}
        return cls(**{**value, **lists, "folder": folder, "left_out": left_out})


def named(names: tuple[str, ...]) -> str:
    """Up to four names, and how many more there are."""
    more = len(names) - MAX_NAMED
    return ", ".join(names[:MAX_NAMED]) + (f" and {more} more" if more > 0 else "")


def read_json(path: Path) -> dict[str, Any] | None:
    """The object in a file; None where there is none, or a broken one."""
    try:
        value = json.loads(path.read_bytes())
    except (OSError, ValueError):
        return None
    return value if isinstance(value, dict) else None
