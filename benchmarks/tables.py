"""Tables of measurements: rows in a .json for programs, Markdown for people."""

import json
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

Row = dict[str, Any]


def markdown(columns: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """A Markdown table."""
    lines = ["| " + " | ".join(columns) + " |", "| --- " * len(columns) + "|"]
    return "\n".join(lines + ["| " + " | ".join(row) + " |" for row in rows]) + "\n"


def figure(value: float | None, form: str = ".2f", *, missing: str = "") -> str:
    """A number as text; `missing` for None."""
    return missing if value is None else format(value, form)


def merged(path: Path, rows: Sequence[Mapping[str, Any]], key: Callable[[Mapping[str, Any]], Any]) -> list[Row]:
    """Writes rows into a .json in place of those with the same key, and returns all that it then holds.

    New keys go to the end, so that the file keeps the order in which things were first measured.
    """
    old: list[Row] = json.loads(path.read_text(encoding="utf-8")) if path.exists() else []
    by_key = {key(row): row for row in old} | {key(row): dict(row) for row in rows}
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps(list(by_key.values()), indent=1) + "\n", encoding="utf-8")
    return list(by_key.values())
