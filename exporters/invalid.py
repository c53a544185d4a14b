"""How readers refuse a file."""

from collections.abc import Iterator
from contextlib import contextmanager

from core.errors import AssetInvalid, PolyfieldError

REMEDY = "Download the file again, or convert the capture again."
_OF_UNEXPECTED_STRUCTURE = (KeyError, TypeError, ValueError, AttributeError, IndexError, OverflowError)


def invalid(subject: str, rule: str, received: str = "") -> AssetInvalid:
    """The error for a file that breaks `rule`."""
    return AssetInvalid(subject, rule, received, REMEDY)


@contextmanager
def only_asset_invalid(subject: str) -> Iterator[None]:
    """Turns what JSON of an unexpected structure leads to, and the scene's own rules, into AssetInvalid.

    Args:
        subject: what is at fault where the error itself does not say.
    """
    try:
        yield
    except AssetInvalid:
        raise
    except PolyfieldError as error:
        raise invalid(error.subject, error.rule, error.received) from error
    except KeyError as error:
        raise invalid(subject, "must follow its schema", f"no {error}"[:120]) from error
    except _OF_UNEXPECTED_STRUCTURE as error:
        raise invalid(subject, "must follow its schema", f"{type(error).__name__}: {error}"[:120]) from error
