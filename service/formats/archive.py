"""A deliverable of several files is one .zip, so that it is there whole or not at all."""

import io
import zipfile
from collections.abc import Mapping

from core.errors import AssetInvalid

COMPRESSED = (".png", ".glb", ".webp")
START_OF_ZIP = (1980, 1, 1, 0, 0, 0)  # no dates: the same scene gives the same archive


def zipped(files: Mapping[str, bytes]) -> bytes:
    """A .zip of files by name; what is compressed already is stored."""
    archive = io.BytesIO()
    with zipfile.ZipFile(archive, "w") as opened:
        for name, data in files.items():
            entry = zipfile.ZipInfo(name, START_OF_ZIP)
            entry.external_attr = 0o644 << 16
            opened.writestr(entry, data, zipfile.ZIP_STORED if name.endswith(COMPRESSED) else zipfile.ZIP_DEFLATED)
    return archive.getvalue()


def unzipped(data: bytes) -> dict[str, bytes]:
    """The files of a .zip that `zipped` has made, by name.

    Raises:
        AssetInvalid
    """
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as opened:
            return {name: opened.read(name) for name in opened.namelist()}
    except zipfile.BadZipFile as error:
        raise AssetInvalid("archive", "must be an intact .zip", str(error)) from error
