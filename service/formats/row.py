"""What is reported of one deliverable."""

from dataclasses import dataclass


@dataclass(frozen=True)
class FormatRow:
    """One format in report.json.

    Attributes:
        file: its name.
        bytes: its size; None where it is missing.
        psnr: mean over the held-out views, dB, of the file read again; None where it was not measured.
        seconds: wall clock of writing, reading again and measuring.
        note: why it was not measured.
        problem: why it is missing; empty where it is there.
    """

    file: str
    bytes: int | None
    psnr: float | None
    seconds: float
    note: str = ""
    problem: str = ""
