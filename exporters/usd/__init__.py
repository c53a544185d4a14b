"""USD: the neural scene with a fallback."""

from exporters.usd.reader import read_usd
from exporters.usd.writer import write_usd

__all__ = ["read_usd", "write_usd"]
