"""Zip archives from strangers."""

import errno
import stat
import struct
import zipfile
import zlib
from collections.abc import Iterator
from pathlib import Path, PurePosixPath

from core.errors import ArchiveInvalid, ArchiveTooLarge, ArchiveUnsafe
from service.names import is_litter, safe_relative_path
from service.settings import Limits

CHUNK_BYTES = 1 << 18
ENCRYPTED = 0x1
# zipfile lets all of these through, depending on where the damage is.
DAMAGED = (zipfile.BadZipFile, zlib.error, struct.error, EOFError, ValueError, RuntimeError, OverflowError)
PACKINGS = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)
REPACK = "Pack the capture's folder again."
SHRINK = "Send photos and pose file only, in fewer or smaller files."


def extract(archive: Path, folder: Path, limits: Limits) -> None:
    """Unpacks `archive` into `folder`, which exists.

    The directory is judged first, and every byte again while inflating: a directory may lie. What was written stays
    behind on an error; the caller removes the folder.

    Raises:
        ArchiveInvalid: not a zip, damaged, encrypted, or the same name twice.
        ArchiveUnsafe: names that leave the folder, or links.
        ArchiveTooLarge: too many files, too many bytes, or packed too well to be photos.
    """
    try:
        with zipfile.ZipFile(archive) as zipped:
            entries = list(_entries(zipped, limits))
            _inflate_all(zipped, entries, folder, limits)
    except DAMAGED as error:
        raise _damaged(archive, error) from None
    except OSError as error:
        if error.errno == errno.EINVAL:  # an offset before the file's start
            raise _damaged(archive, error) from None
        raise


def _damaged(archive: Path, error: Exception) -> ArchiveInvalid:
    return ArchiveInvalid(archive.name, "must be an intact zip archive", str(error)[:120], REPACK)


def _entries(zipped: zipfile.ZipFile, limits: Limits) -> Iterator[tuple[zipfile.ZipInfo, PurePosixPath]]:
    infos = zipped.infolist()
    if len(infos) > limits.files:
        raise ArchiveTooLarge("archive", f"at most {limits.files} files", str(len(infos)), SHRINK)
    total = sum(info.file_size for info in infos)
    if total > limits.archive_bytes:
        raise ArchiveTooLarge("archive", f"at most {limits.archive_bytes} bytes inflated", str(total), SHRINK)
    seen: set[str] = set()
    for info in infos:
        path = safe_relative_path(info.filename, "archive")
        _refuse_link(info)
        if info.is_dir() or is_litter(path):
            continue
        _require_modest(info, limits)
        # Case folded, so that the outcome is the same on every file system.
        key = str(path).casefold()
        if key in seen:
            raise ArchiveInvalid(f"archive, name {info.filename!r}", "must appear once", "it twice", REPACK)
        seen.add(key)
        yield info, path


def _refuse_link(info: zipfile.ZipInfo) -> None:
    kind = stat.S_IFMT(info.external_attr >> 16)
    if kind not in (0, stat.S_IFREG, stat.S_IFDIR):
        rule = "must hold plain files and folders only"
        remedy = "Pack the files themselves, not links to them."
        raise ArchiveUnsafe(f"archive, name {info.filename!r}", rule, "a link or device", remedy)


def _require_modest(info: zipfile.ZipInfo, limits: Limits) -> None:
    subject = f"archive, name {info.filename!r}"
    if info.flag_bits & ENCRYPTED:
        raise ArchiveInvalid(subject, "must not be encrypted", "", "Pack it without a password.")
    if info.compress_type not in PACKINGS:
        raise ArchiveInvalid(subject, "must be stored or deflated", f"method {info.compress_type}", REPACK)
    _require_size(info, info.file_size, limits)


def _require_size(info: zipfile.ZipInfo, inflated: int, limits: Limits) -> None:
    subject = f"archive, name {info.filename!r}"
    if inflated > limits.file_bytes:
        raise ArchiveTooLarge(subject, f"at most {limits.file_bytes} bytes inflated", str(inflated), SHRINK)
    ratio = inflated / max(info.compress_size, 1)
    if inflated > limits.ratio_free_bytes and ratio > limits.archive_ratio:
        rule = f"must not inflate to more than {limits.archive_ratio:.0f} times its packed size"
        raise ArchiveTooLarge(subject, rule, f"{ratio:.0f} times", "No photo packs so well: leave this file out.")


def _inflate_all(
    zipped: zipfile.ZipFile, entries: list[tuple[zipfile.ZipInfo, PurePosixPath]], folder: Path, limits: Limits
) -> None:
    left = limits.archive_bytes
    for info, path in entries:
        target = folder / path
        try:
            target.parent.mkdir(parents=True, exist_ok=True)
            left -= _inflate(zipped, info, target, left, limits)
        except (FileExistsError, NotADirectoryError, IsADirectoryError):
            rule = "must not be both a file and a folder"
            raise ArchiveInvalid(f"archive, name {info.filename!r}", rule, "both", REPACK) from None


def _inflate(zipped: zipfile.ZipFile, info: zipfile.ZipInfo, target: Path, left: int, limits: Limits) -> int:
    written = 0
    with zipped.open(info) as source, target.open("xb") as file:
        while chunk := source.read(CHUNK_BYTES):
            written += len(chunk)
            if written > left:
                raise ArchiveTooLarge("archive", f"at most {limits.archive_bytes} bytes inflated", "more", SHRINK)
            _require_size(info, written, limits)
            file.write(chunk)
    return written
