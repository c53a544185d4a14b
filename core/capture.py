"""A capture: posed photos, and which of them are held out."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from core.camera import Camera
from core.conventions import ASSET_FROM_Z_UP
from core.errors import CaptureEmpty, ImageSizeMismatch, PosesInvalid, TooFewImages
from core.scene_kind import UNDECIDED, SceneKind, detect_kind

MIN_TRAIN_IMAGES = 2
WHITE = (1.0, 1.0, 1.0)


@dataclass(frozen=True)
class View:
    """One photo and its camera.

    Attributes:
        camera: its size is the image's.
        image_u8: [height, width, 3 or 4] uint8, sRGB, straight (not premultiplied) alpha.
        ignored: [height, width] bool, pixels that a mask takes out of training and measuring; None for none. (Alpha is
            another thing: it says that the object is not there.)
        depth_range: (near, far), 0 < near <= far, along the optical axis in the camera's units; None if not known.

    Raises:
        ImageSizeMismatch, PosesInvalid
    """

    camera: Camera
    image_u8: np.ndarray
    ignored: np.ndarray | None = None
    depth_range: tuple[float, float] | None = None

    def __post_init__(self) -> None:
        self._check_size("photo", self.image_u8)
        if self.ignored is not None:
            self._check_size("mask of photo", self.ignored)
        if self.depth_range is not None and not 0 < self.depth_range[0] <= self.depth_range[1] < np.inf:
            raise PosesInvalid(
                f"depth bounds of {self.camera.name}",
                "must be finite and positive, near before far",
                str(self.depth_range),
                "Correct the bounds, or leave them out.",
            )

    def _check_size(self, subject: str, image: np.ndarray) -> None:
        height, width = image.shape[:2]
        if (width, height) != tuple(self.camera.size_px):
            raise ImageSizeMismatch(
                f"{subject} {self.camera.name}",
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
        asset_from_object: [4, 4] float64, rigid with uniform scale: from the object frame to glTF's (+y up).
        notes: remarks for the user (photos left out, assumptions made).
        user_from_object: [4, 4] float64, rigid with uniform scale: back to the frame of the user's files.
        points: [n, 3] float64, sparse points of the scene's surfaces in the object frame; None where there are none.
        kind: object, forward-facing or unbounded; detected where it is not given.

    Raises:
        TooFewImages, CaptureEmpty
    """

    train: tuple[View, ...]
    test: tuple[View, ...]
    background: tuple[float, float, float] = WHITE
    asset_from_object: np.ndarray = field(default_factory=lambda: ASSET_FROM_Z_UP.copy())
    notes: tuple[str, ...] = ()
    user_from_object: np.ndarray = field(default_factory=lambda: np.eye(4))
    points: np.ndarray | None = None
    kind: SceneKind = UNDECIDED

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
        if all(view.ignored is not None and view.ignored.all() for view in self.train):
            raise CaptureEmpty(
                "capture",
                "at least one training photo must have pixels that no mask takes out",
                f"{len(self.train)} photos that are masked entirely",
                "Check the masks: black is left out, white is kept.",
            )
        if self.kind is UNDECIDED:
            object.__setattr__(self, "kind", detect_kind(self))

    @property
    def has_alpha(self) -> bool:
        """Whether every training photo says what belongs to the object."""
        return all(view.has_alpha for view in self.train)
