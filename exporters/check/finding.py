"""One thing that is wrong with an asset."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal, ParamSpec, TypeVar

from core.errors import AssetInvalid
from exporters.invalid import only_asset_invalid

Severity = Literal["error", "warning", "note"]
P = ParamSpec("P")
T = TypeVar("T")


@dataclass(frozen=True)
class Finding:
    """Attributes:
    severity: an error is shown wrongly or not at all somewhere; a warning may be; a note says what was not checked.
    code: the area, stable: container, json, extension, background, frame, view, network, shader, texture, mesh, hole,
        feature, fallback.
    subject: the thing at fault.
    message: what must hold, and what was found.
    """

    severity: Severity
    code: str
    subject: str
    message: str

    def __str__(self) -> str:
        """One line, whatever the file has put into it."""
        return _printable(f"{self.severity} [{self.code}] {self.subject}: {self.message}")


def _printable(text: str) -> str:
    """Line ends, escape sequences and halves of characters as Python would write them."""
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode("ascii") for c in text)


class Findings(list[Finding]):
    """Collects."""

    def error(self, code: str, subject: str, message: str) -> None:
        self.append(Finding("error", code, subject, message))

    def warning(self, code: str, subject: str, message: str) -> None:
        self.append(Finding("warning", code, subject, message))

    def attempt(self, code: str, subject: str, step: Callable[P, T], *args: P.args, **kwargs: P.kwargs) -> T | None:
        """What `step` returns; None where it refuses the file, which becomes a finding.

        Args:
            subject: what is at fault where the refusal does not say.
        """
        try:
            with only_asset_invalid(subject):
                return step(*args, **kwargs)
        except AssetInvalid as refusal:
            received = f", but got {refusal.received}" if refusal.received else ""
            self.error(code, refusal.subject, f"{refusal.rule}{received}")
            return None
