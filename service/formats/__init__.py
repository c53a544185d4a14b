"""The deliverables: what a scene can be exported to, and how the quality of each is measured on what was written."""

from service.formats.registry import DEFAULT, FORMATS, Format, formats_of
from service.formats.row import FormatRow

__all__ = ["DEFAULT", "FORMATS", "Format", "FormatRow", "formats_of"]
