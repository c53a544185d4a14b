"""What a capture's pose file promises, checked against photo headers, before any pixel is decoded."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path, PurePosixPath

import numpy as np

from core.camera import Camera
from core.capture import MIN_TRAIN_IMAGES
from core.datasets.lens import Lens
from core.errors import TooFewImages

HOLD_OUT_EVERY = 8  # as LLFF and everyone since


@dataclass(frozen=True)
class Photo:
    """A photo that is posed but not decoded.

    Attributes:
        name: its path within the capture, for messages.
        stated_path: what the pose file calls it.
        camera: of the undistorted photo at full size.
        lens: of the photo as it is stored.
        mask_path: a picture whose black takes pixels out of training and measuring.
        depth_range: (near, far) in the camera's units.
        scale: how many times smaller the stored photo is than what "full size" means to the user.
    """

    path: Path
    name: str
    stated_path: PurePosixPath
    camera: Camera
    lens: Lens
    mask_path: Path | None = None
    depth_range: tuple[float, float] | None = None
    scale: float = 1.0


@dataclass(frozen=True)
class Listing:
    """Photos to learn from, photos held out, and remarks for the user.

    Attributes:
        points: [n, 3] float64, sparse points in the frame of the poses, or None.
        up_known: the poses' frame has +z up by convention.

    Raises:
        TooFewImages
    """

    train: tuple[Photo, ...]
    test: tuple[Photo, ...]
    notes: tuple[str, ...] = ()
    points: np.ndarray | None = None
    up_known: bool = True

    def __post_init__(self) -> None:
        if len(self.train) < MIN_TRAIN_IMAGES:
            held_out = f" (and {len(self.test)} held out)" if self.test else ""
            raise TooFewImages(
                "capture",
                f"at least {MIN_TRAIN_IMAGES} training photos are needed to see depth",
                f"{len(self.train)}{held_out}",
                "Add photos from other directions; 30 to 100 all around give a good result.",
            )

    @property
    def photos(self) -> tuple[Photo, ...]:
        return self.train + self.test


def held_out(photos: list[Photo]) -> tuple[tuple[Photo, ...], tuple[Photo, ...]]:
    """(train, test): sorted by file name, photos 0, 8, 16 ... are held out; of two photos none can be spared."""
    photos = sorted(photos, key=lambda photo: photo.name)
    if len(photos) <= MIN_TRAIN_IMAGES:
        return tuple(photos), ()
    test = tuple(photos[::HOLD_OUT_EVERY])
    train = tuple(photo for index, photo in enumerate(photos) if index % HOLD_OUT_EVERY)
    return train, test


def mask_notes(photos: list[Photo]) -> tuple[str, ...]:
    """A remark on masks, if there are any."""
    count = sum(photo.mask_path is not None for photo in photos)
    return (f"Masks of {count} of {len(photos)} photos are used: what they show black is left out.",) if count else ()
