"""Checkpoints: written whole or not at all, and read back only into the run that they belong to."""

import os
import time
from pathlib import Path
from typing import Any

import torch

from core.errors import CheckpointInvalid

FILE_NAME = "training.pt"
# Writing may take this share of the training time at most, and happens no more often than the interval (seconds).
WRITING_SHARE = 0.03
INTERVAL_S = 5.0


class CheckpointFile:
    """The checkpoint of one run in a folder.

    Args:
        folder: where; created where missing. None: nothing is kept.
        identity: what the run is of (settings, seed, capture); another run's checkpoint is ignored.
    """

    def __init__(self, folder: Path | None, identity: dict[str, Any]) -> None:
        self._path = None if folder is None else folder / FILE_NAME
        self._identity = identity
        self._cost_s = 0.0
        self._written_at = time.monotonic()

    def due(self) -> bool:
        """Whether it is time to write again."""
        wait = max(INTERVAL_S, self._cost_s / WRITING_SHARE)
        return self._path is not None and time.monotonic() - self._written_at >= wait

    def write(self, stage: str, state: dict[str, Any]) -> None:
        """Replaces the checkpoint: a reader finds the old one or the new one, even after a power cut."""
        if self._path is None:
            return
        start = time.monotonic()
        self._path.parent.mkdir(parents=True, exist_ok=True)
        temporary = self._path.with_suffix(".part")
        with temporary.open("wb") as file:
            torch.save({"identity": self._identity, "stage": stage, "state": state}, file)
            file.flush()
            os.fsync(file.fileno())
        temporary.replace(self._path)
        self._written_at = time.monotonic()
        self._cost_s = self._written_at - start

    def read(self) -> tuple[str, dict[str, Any]] | None:
        """(stage, state) of this very run, or None.

        Raises:
            CheckpointInvalid: the file is damaged.
        """
        if self._path is None or not self._path.exists():
            return None
        try:
            content = torch.load(self._path, map_location="cpu", weights_only=True)
            if not isinstance(content, dict):
                raise TypeError(f"a {type(content).__name__}")
            identity, stage, state = (content[key] for key in ("identity", "stage", "state"))
        except Exception as error:  # bytes that are not a checkpoint make torch.load raise almost anything
            raise CheckpointInvalid(
                str(self._path), "must be a checkpoint", _first_line(error), "Delete it to start afresh."
            ) from error
        return (stage, state) if identity == self._identity else None

    def remove(self) -> None:
        """Removes the file, if any."""
        if self._path is not None:
            self._path.unlink(missing_ok=True)


def _first_line(error: Exception) -> str:
    lines = str(error).splitlines()
    return lines[0][:200] if lines else type(error).__name__
