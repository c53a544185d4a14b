"""How the reader refuses a file."""

from core.errors import AssetInvalid

REMEDY = "Download the file again, or convert the capture again."


def invalid(subject: str, rule: str, received: str = "") -> AssetInvalid:
    """The error for a file that breaks `rule`."""
    return AssetInvalid(subject, rule, received, REMEDY)
