"""The folder that posing works in. A run that was stopped, however it was, goes on from what lies there.

masks            a link to the photos' masks, if there are any
images/          links to the photos; upright copies of those that are stored lying on a side
database.db      COLMAP's: features and matches, each written when it is found; gone when posing is done
pairs.txt        the pairs that it is matching; gone, too
sparse/0/        the model
identity.json    what the folder was made from; work for other photos or settings is thrown away
seconds.json     spent so far; gone, too
posing.json      the outcome, written last
"""

from __future__ import annotations

import hashlib
import json
import os
import shutil
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from PIL import Image, ImageOps

from core.datasets.masks import FOLDER as MASKS
from core.images import FORMATS
from core.posing.headers import Header
from core.posing.photo_set import PhotoSet
from core.posing.posing import Posing, read_json

# To be raised when anything here changes the outcome.
FORMAT = 1
JPEG_QUALITY = 97  # of upright copies: 50 dB and more to the photo


@dataclass(frozen=True)
class Workspace:
    folder: Path

    @property
    def images(self) -> Path:
        return self.folder / "images"

    @property
    def database(self) -> Path:
        return self.folder / "database.db"

    @property
    def model(self) -> Path:
        return self.folder / "sparse" / "0"

    def claim(self, identity: dict[str, Any]) -> None:
        """Keeps what lies there for this work, and removes what was for any other."""
        self.folder.mkdir(parents=True, exist_ok=True)
        if read_json(self.folder / "identity.json") != identity:
            self._clear()
            self._write("identity.json", identity)

    def outcome(self) -> Posing | None:
        """Of a posing that was finished."""
        value = read_json(self.folder / "posing.json")
        return Posing.from_json(value, self.folder) if value else None

    def seconds(self) -> dict[str, float]:
        """Spent on each stage by earlier runs."""
        return read_json(self.folder / "seconds.json") or {}

    def keep_seconds(self, seconds: dict[str, float]) -> None:
        self._write("seconds.json", seconds)

    def finish(self, posing: Posing) -> None:
        self._write("posing.json", posing.as_json())
        self._remove_database()

    def link_photos(self, photos: PhotoSet, headers: dict[str, Header]) -> None:
        """Makes `images/` anew where it does not lead to the photos: their folder may have moved.

        Photos that should be turned but cannot be decoded are linked as they are; decoding fails again later.
        """
        for name in photos.names:
            target = self.images / name
            target.parent.mkdir(parents=True, exist_ok=True)
            turned = headers[name].orientation != 1 and not target.is_symlink()
            if turned and (target.exists() or _write_upright(photos.path(name), target)):
                continue
            _link(photos.path(name).resolve(), target)
        if photos.masks:
            _link(photos.masks.resolve(), self.folder / MASKS)

    def _clear(self) -> None:
        for path in (self.images, self.folder / "sparse"):
            shutil.rmtree(path, ignore_errors=True)
        for name in ("posing.json", "identity.json", MASKS):
            (self.folder / name).unlink(missing_ok=True)
        self._remove_database()

    def _remove_database(self) -> None:
        for name in ("pairs.txt", "seconds.json"):
            (self.folder / name).unlink(missing_ok=True)
        for suffix in ("", "-journal", "-wal", "-shm"):
            self.database.with_name(self.database.name + suffix).unlink(missing_ok=True)

    def _write(self, name: str, value: dict[str, Any]) -> None:
        part = self.folder / f".{name}.part"
        part.write_text(json.dumps(value, indent=1))
        part.replace(self.folder / name)


def identity_of(photos: PhotoSet, **settings: object) -> dict[str, Any]:
    """What the outcome depends on."""
    digest = hashlib.blake2b(digest_size=16)
    for name in photos.names:
        with photos.path(name).open("rb") as file:
            digest.update(f"{name}\n".encode())
            digest.update(hashlib.file_digest(file, "sha256").digest())
    return {"format": FORMAT, "photos": digest.hexdigest(), **settings}


def own_folder(work_folder: Path, photos_folder: Path) -> Path:
    """What is ours where people want the results beside the photos: pictures in there are not photos."""
    results = work_folder.parent
    return results if photos_folder in results.parents else work_folder


def _link(source: Path, target: Path) -> None:
    if target.is_symlink() and Path(os.readlink(target)) == source:
        return
    target.unlink(missing_ok=True)
    target.symlink_to(source)


def _write_upright(source: Path, target: Path) -> bool:
    """Whether there is an upright copy now.

    Cameras held sideways store the photo as it fell on the sensor; poses of such photos would lie on a side, too.
    """
    part = target.with_name(f".{target.name}.part")
    try:
        with Image.open(source, formats=FORMATS) as image:
            upright = ImageOps.exif_transpose(image)
            lossy = {"quality": JPEG_QUALITY, "subsampling": 0}
            upright.save(part, image.format, **(lossy if image.format == "JPEG" else {"lossless": True}))
    except Exception:  # decoders raise anything on damaged files
        part.unlink(missing_ok=True)
        return False
    part.replace(target)
    return True
