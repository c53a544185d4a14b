"""USD for phones."""

from exporters.usd.quicklook.writer import write_quicklook

__all__ = ["write_quicklook"]
