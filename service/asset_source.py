"""An asset's files on disk: a .glb, or a .gltf and the files that it names."""

import json
import stat
from collections.abc import Iterator, Mapping
from pathlib import Path, PurePosixPath
from typing import Any
from urllib.parse import unquote

from core.errors import AssetInvalid

# The most that a .glb can state as its length; what a .gltf may have in all.
MOST_BYTES = 2**32 - 1
FORMATS = "Give a .glb, or a .gltf with its files beside it; other formats have checkers of their own."


def glb_bytes(path: Path) -> bytes:
    """What a file holds.

    Raises:
        AssetInvalid: it cannot be read, or is longer than a .glb can be.
    """
    return _content(path, MOST_BYTES)


def gltf_files(path: Path) -> dict[str, bytes]:
    """A .gltf and the files that its URIs name, if they are below its folder and are there; by URI, decoded.

    Raises:
        AssetInvalid: the .gltf cannot be read, or all is longer than `MOST_BYTES`.
    """
    files = {path.name: _content(path, MOST_BYTES)}
    folder, left = path.parent.resolve(), MOST_BYTES - len(files[path.name])
    for name in _named(files[path.name]):
        beside = folder / name
        if name not in files and beside.is_file() and beside.resolve().is_relative_to(folder):
            files[name] = _content(beside, left)
            left -= len(files[name])
    return files


def is_gltf(path: Path) -> bool:
    """Whether it is a .gltf; False of a .glb, by its first bytes or its name.

    Raises:
        AssetInvalid: neither, or there is no such file.
    """
    try:
        mode = path.stat().st_mode
    except (OSError, ValueError) as error:  # ValueError: a name with a zero in it
        raise _unreadable(path, error) from error
    if not stat.S_ISREG(mode):
        raise AssetInvalid(str(path), "must be a file", "a folder" if stat.S_ISDIR(mode) else "a device", FORMATS)
    kind = path.suffix.lower()
    if kind == ".gltf":
        return True
    if kind != ".glb" and _start(path) != b"glTF":
        raise AssetInvalid(str(path), "must be a .glb or a .gltf", kind or "neither", FORMATS)
    return False


def _named(text: bytes) -> Iterator[str]:
    """Relative file names among the URIs of buffers and images; none where the JSON is damaged."""
    try:
        document: Any = json.loads(text)
    except (ValueError, RecursionError):
        return
    for kind in ("buffers", "images"):
        items = document.get(kind) if isinstance(document, Mapping) else None
        for item in items if isinstance(items, list) else []:
            uri = item.get("uri") if isinstance(item, Mapping) else None
            name = unquote(uri) if isinstance(uri, str) else ""
            if name and name.isprintable() and ":" not in name and not _leaves(PurePosixPath(name)):
                yield name


def _leaves(name: PurePosixPath) -> bool:
    return name.is_absolute() or ".." in name.parts


def _start(path: Path) -> bytes:
    try:
        with path.open("rb") as file:
            return file.read(4)
    except OSError as error:
        raise _unreadable(path, error) from error


def _content(path: Path, most_bytes: int) -> bytes:
    try:
        size = path.stat().st_size
        if size > most_bytes:
            raise AssetInvalid(str(path), f"must have at most {most_bytes} bytes", f"{size}")
        with path.open("rb") as file:
            return file.read(size)
    except OSError as error:
        raise _unreadable(path, error) from error


def _unreadable(path: Path, error: Exception) -> AssetInvalid:
    return AssetInvalid(str(path), "must be readable", getattr(error, "strerror", None) or str(error))
