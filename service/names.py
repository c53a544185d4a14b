"""Names that strangers give to files."""

import re
from pathlib import PurePosixPath

from core.errors import ArchiveUnsafe

MAX_NAME_BYTES = 255  # of one component, on the common file systems
MAX_DEPTH = 16
DRIVE = re.compile(r"[A-Za-z]:")
CONTROL = re.compile(r"[\x00-\x1f\x7f]")


def safe_relative_path(name: str, within: str) -> PurePosixPath:
    """The path that an uploaded name may have below a folder.

    Args:
        name: such as `train/r_0.png`; leading `./` and doubled slashes are dropped.
        within: what the name was found in, for the message.

    Raises:
        ArchiveUnsafe: absolute, with `..`, a backslash, a drive letter, a control character, or too long or deep.
    """
    fault = _fault(name)
    if fault:
        raise ArchiveUnsafe(
            f"{within}, name {name[:120]!r}",
            "must stay inside the capture",
            fault,
            "Name files relative to the capture's folder, with forward slashes, such as images/0001.png.",
        )
    return PurePosixPath(*(part for part in name.split("/") if part not in ("", ".")))


def is_litter(path: PurePosixPath) -> bool:
    """Whether an operating system left the file in the folder on its own account."""
    return path.parts[0] == "__MACOSX" or path.name in (".DS_Store", "Thumbs.db", "desktop.ini")


def _fault(name: str) -> str:
    parts = [part for part in name.split("/") if part not in ("", ".")]
    if not parts:
        return "an empty name"
    if name.startswith("/"):
        return "an absolute name"
    if "\\" in name:
        return "a backslash"
    if DRIVE.match(parts[0]):
        return "a drive letter"
    if ".." in parts:
        return "'..'"
    if CONTROL.search(name):
        return "a control character"
    if not _is_encodable(name):
        return "characters that are not Unicode"
    if len(parts) > MAX_DEPTH or any(len(part.encode()) > MAX_NAME_BYTES for part in parts):
        return "a name too long or too deep"
    return ""


def _is_encodable(name: str) -> bool:
    try:
        name.encode()
    except UnicodeEncodeError:
        return False
    return True
