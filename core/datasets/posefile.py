"""A pose file: JSON from strangers, with every field checked where it is read."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeGuard

import numpy as np

from core.errors import PoseNotFinite, PosesInvalid

MAX_BYTES = 64 << 20  # about 100,000 frames
REMEDY = "Export the poses again, or correct the file by hand."


@dataclass(frozen=True)
class PoseFile:
    """A JSON object of a pose file, or one of its frames.

    Attributes:
        name: what messages call it.
        fields: the object as parsed.
    """

    name: str
    fields: dict[str, Any]

    def number(self, key: str) -> float | None:
        """A finite number; None where the key is missing or null.

        Raises:
            PosesInvalid
        """
        value = self.fields.get(key)
        if value is None:
            return None
        number = _as_float(value)
        if number is None or not math.isfinite(number):
            raise self.invalid(f'"{key}" must be a finite number', value)
        return number

    def size(self, key: str) -> int | None:
        """A positive whole number (1080.0 counts), or None."""
        number = self.number(key)
        if number is not None and not (1 <= number <= 1e6 and number == int(number)):
            raise self.invalid(f'"{key}" must be a positive whole number', number)
        return None if number is None else int(number)

    def text(self, key: str, default: str | None = None) -> str | None:
        value = self.fields.get(key, default)
        if value is not None and not isinstance(value, str):
            raise self.invalid(f'"{key}" must be a string', value)
        return value

    def texts(self, key: str) -> list[str] | None:
        """A list of strings, or None."""
        value = self.fields.get(key)
        if value is None:
            return None
        if not isinstance(value, list) or not all(isinstance(item, str) for item in value):
            raise self.invalid(f'"{key}" must be a list of strings', value)
        return value

    def frames(self) -> list[PoseFile]:
        """The frames, at least one."""
        frames = self.fields.get("frames")
        if not isinstance(frames, list) or not frames:
            raise self.invalid('"frames" must be a list of at least one photo', frames)
        for index, frame in enumerate(frames):
            if not isinstance(frame, dict):
                raise self.invalid(f"frame {index} must be an object", frame)
        return [PoseFile(f"frame {index} of {self.name}", frame) for index, frame in enumerate(frames)]

    def matrix(self, key: str = "transform_matrix") -> np.ndarray:
        """A [4, 4] or [3, 4] float64 matrix; whether it is rigid is the camera's matter.

        Raises:
            PosesInvalid, PoseNotFinite
        """
        rows = self.fields.get(key)
        if not _is_matrix(rows):
            raise self.invalid(f'"{key}" must be 4 rows of 4 numbers', rows)
        matrix = np.array([[_as_float(value) for value in row] for row in rows], np.float64)
        if not np.isfinite(matrix).all():
            raise PoseNotFinite(
                f"pose of {self.fields.get('file_path', self.name)}",
                "every entry must be a finite number",
                "NaN or infinity",
                "Leave this photo out of the pose file, or pose it again.",
            )
        return matrix

    def invalid(self, rule: str, value: object) -> PosesInvalid:
        return PosesInvalid(self.name, rule, "nothing" if value is None else shortened(value), REMEDY)


def read_pose_file(path: Path) -> PoseFile:
    """A pose file, parsed.

    Raises:
        PosesInvalid: too large, not UTF-8, not JSON, or not an object.
    """
    try:
        if path.stat().st_size > MAX_BYTES:
            raise PosesInvalid(
                path.name, f"must be at most {MAX_BYTES >> 20} MB", f"{path.stat().st_size} bytes", REMEDY
            )
        fields = json.loads(path.read_bytes().decode("utf-8-sig"))
    except RecursionError as error:
        raise PosesInvalid(path.name, "must be JSON", "lists nested too deeply", REMEDY) from error
    except (ValueError, OSError) as error:
        raise PosesInvalid(path.name, "must be JSON", f"a file that is not ({shortened(error)})", REMEDY) from error
    if not isinstance(fields, dict):
        raise PosesInvalid(path.name, "must be a JSON object", shortened(fields), REMEDY)
    return PoseFile(path.name, fields)


def shortened(value: object) -> str:
    """A value as a message shows it."""
    text = value if isinstance(value, str) else str(value) if isinstance(value, Exception) else repr(value)
    return text if len(text) <= 80 else text[:77] + "..."


def _is_matrix(rows: object) -> TypeGuard[list[list[float]]]:
    if not isinstance(rows, list) or len(rows) not in (3, 4):
        return False
    return all(isinstance(row, list) and len(row) == 4 and None not in map(_as_float, row) for row in rows)


def _as_float(value: object) -> float | None:
    if isinstance(value, bool) or not isinstance(value, int | float):
        return None
    try:
        return float(value)
    except OverflowError:
        return math.inf
