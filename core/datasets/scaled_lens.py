"""The lens of a photo that is stored smaller (or larger) than the one that was posed."""

from __future__ import annotations

from core.datasets.lens import Lens
from core.errors import ImageSizeMismatch


def same_shape(one_px: tuple[int, int], other_px: tuple[int, int]) -> bool:
    """Whether one image can be a scaled copy of another, its sides (width, height) rounded up or down."""
    small, large = sorted((one_px, other_px))
    (low_x, high_x), (low_y, high_y) = (
        ((side - 1) / full, (side + 1) / full) for side, full in zip(small, large, strict=True)
    )
    return low_x <= high_y and low_y <= high_x


def of_stored_size(lens: Lens, size_px: tuple[int, int], name: str) -> Lens:
    """The lens, scaled from the posed photo's size to the stored one's (width, height).

    Distortion is in normalised coordinates, so it stays.

    Args:
        name: the photo's, for messages.

    Raises:
        ImageSizeMismatch: the shape differs, as for a cropped or turned photo.
    """
    if size_px == lens.size_px:
        return lens
    sx, sy = size_px[0] / lens.size_px[0], size_px[1] / lens.size_px[1]
    if not same_shape(size_px, lens.size_px):
        turned = size_px == lens.size_px[::-1]
        raise ImageSizeMismatch(
            f"photo {name}",
            f"must have the {lens.size_px[0]} x {lens.size_px[1]} px that were posed, or be a scaled copy",
            f"{size_px[0]} x {size_px[1]} px",
            "Store the photos upright before posing them; their EXIF orientation is not applied."
            if turned
            else "Use the photos that were posed.",
        )
    focal_px = (lens.focal_px[0] * sx, lens.focal_px[1] * sy)
    return Lens(focal_px, (lens.centre_px[0] * sx, lens.centre_px[1] * sy), size_px, lens.distortion)
