"""A capture: posed photos, and which of them are held out."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from core.camera import Camera
from core.conventions import ASSET_FROM_Z_UP
from core.errors import CaptureEmpty, ImageSizeMismatch, TooFewImages

MIN_TRAIN_IMAGES = 2
WHITE = (1.0, 1.0, 1.0)


@dataclass(frozen=True)
class View:
    """One photo and its camera.

    Attributes:
        camera: its size is the image's.
        image_u8: [height, width, 3 or 4] uint8, sRGB, straight (not premultiplied) alpha.
    """

    camera: Camera
    image_u8: np.ndarray

    def __post_init__(self) -> None:
        height, width = self.image_u8.shape[:2]
        if (width, height) != tuple(self.camera.size_px):
            raise ImageSizeMismatch(
                f"photo {self.camera.name}",
                "must have the size its camera states",
                f"{width} x {height} px for a camera of {self.camera.size_px[0]} x {self.camera.size_px[1]} px",
                "Use the photos that were posed, or correct the size in the pose file.",
            )

    @property
    def has_alpha(self) -> bool:
        return self.image_u8.shape[2] == 4

    def premultiplied(self) -> tuple[np.ndarray, np.ndarray]:
        """(colour * alpha [h, w, 3], alpha [h, w]) as float32 in [0, 1]; alpha is 1 for a photo without."""
        rgb = self.image_u8[..., :3].astype(np.float32) / 255.0
        if not self.has_alpha:
            return rgb, np.ones(rgb.shape[:2], np.float32)
        alpha = self.image_u8[..., 3].astype(np.float32) / 255.0
        return rgb * alpha[..., None], alpha

    def over(self, background: Sequence[float]) -> np.ndarray:
        """The photo over a background colour (sRGB, [0, 1]): [h, w, 3] float32."""
        rgb, alpha = self.premultiplied()
        return rgb + (1.0 - alpha[..., None]) * np.asarray(background, np.float32)


@dataclass(frozen=True)
class Capture:
    """Posed photos of one scene.

    Attributes:
        train, test: views to learn from, and views held out to measure on (may be empty).
        background: sRGB in [0, 1], behind transparent pixels.
        asset_from_object: [4, 4] float64, from the capture's frame to glTF's (+y up).
        notes: remarks for the user (photos left out, assumptions made).

    Raises:
        TooFewImages, CaptureEmpty
    """

    train: tuple[View, ...]
    test: tuple[View, ...]
    background: tuple[float, float, float] = WHITE
    asset_from_object: np.ndarray = field(default_factory=lambda: ASSET_FROM_Z_UP.copy())
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        if len(self.train) < MIN_TRAIN_IMAGES:
            raise TooFewImages(
                "capture",
                f"at least {MIN_TRAIN_IMAGES} training photos are needed to see depth",
                f"{len(self.train)} (and {len(self.test)} held out)",
                "Add photos from other directions; 30 to 100 all around give a good result.",
            )
        if all(view.has_alpha and not view.image_u8[..., 3].any() for view in self.train):
            raise CaptureEmpty(
                "capture",
                "at least one training photo must show something",
                f"{len(self.train)} photos that are fully transparent",
                "Check the masks or the alpha channel of the photos.",
            )

    @property
    def has_alpha(self) -> bool:
        """Whether every training photo says what belongs to the object."""
        return all(view.has_alpha for view in self.train)
