"""A page taken apart into quads, each with a patch: the rectangle of texels that it shows.

Patches of all sizes lie in one array; patch n is rows offsets[n] to offsets[n] + h * w.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from core.baked import Page
from core.conventions import FEATURE_CHANNELS
from exporters.compaction.windows import as_bytes, as_items, windows

CHANNELS = FEATURE_CHANNELS + 3  # features, then the fallback's colour
# How far, in texels, a corner may be from a texel's centre: float32 on 4096 texels gives 2e-4, other tools' decimals
# 2e-3.
OFF_CENTRE = 0.01
TEXELS_AT_ONCE = 1 << 17  # 1.5 MB, or 5 MB of moments; with less, small steps take longer, and wait for each other


@dataclass(frozen=True)
class Patches:
    """Attributes:
    sizes: int64 [N, 2], (height, width) in texels.
    texels: uint8 [T, 11], row-major within a patch: eight features, then red, green, blue of the fallback.
    starts: int64 [N], first row of each patch; None: they lie one after the other and make up all of `texels`.
    """

    sizes: np.ndarray
    texels: np.ndarray
    starts: np.ndarray | None = None

    @property
    def areas(self) -> np.ndarray:
        """[N] texels."""
        areas: np.ndarray = self.sizes.prod(1)
        return areas

    @cached_property
    def offsets(self) -> np.ndarray:
        """[N] first row of each patch."""
        if self.starts is not None:
            return self.starts
        offsets: np.ndarray = np.cumsum(self.areas) - self.areas
        return offsets

    def subset(self, numbers: np.ndarray) -> "Patches":
        """Patches `numbers` [n] alone; nothing is copied."""
        return Patches(self.sizes[numbers], self.texels, self.offsets[numbers])

    def groups(self, numbers: np.ndarray | None = None) -> Iterator[np.ndarray]:
        """Numbers [n] of patches of one size, about TEXELS_AT_ONCE texels at a time.

        Args:
            numbers: the patches to go through; None: all.
        """
        numbers = np.arange(len(self.sizes)) if numbers is None else numbers
        sizes = self.sizes[numbers]
        for height, width in np.unique(sizes, axis=0):
            equal = numbers[(sizes == (height, width)).all(1)]
            yield from (equal[part] for part in slices(len(equal), TEXELS_AT_ONCE // (height * width)))

    def content(self, numbers: np.ndarray) -> np.ndarray:
        """Texels [n, h, w, 11] of patches of one size; not to be written to."""
        height, width = self.sizes[numbers[0]]
        starts, area = self.offsets[numbers], height * width
        if (np.diff(starts) == area).all():
            texels = self.texels[starts[0] : starts[0] + len(numbers) * area]
        else:
            texels = as_bytes(windows(self.texels, area)[starts])
        return texels.reshape(len(numbers), height, width, CHANNELS)

    def place(self, numbers: np.ndarray, texels: np.ndarray) -> None:
        """Writes the texels [n, h, w, 11] of patches that have this size."""
        windows(self.texels, texels.shape[1] * texels.shape[2])[self.offsets[numbers]] = as_items(texels, 1)


def slices(count: int, at_once: int) -> Iterator[slice]:
    """Consecutive ones of `at_once`, but at least 1, that make up `count`."""
    step = max(1, at_once)
    return (slice(first, first + step) for first in range(0, count, step))


@dataclass(frozen=True)
class Quads:
    """Attributes:
    corners: float32 [Q, 4, 3], object frame.
    ends: bool [Q, 4, 2]: whether a corner stands on the last column (x) and the last row (y) of its patch.
    triangles: uint32 [Q, 2, 3], of a quad's corners 0 to 3.
    patch: int64 [Q], which patch each shows.
    patches: theirs.
    """

    corners: np.ndarray
    ends: np.ndarray
    triangles: np.ndarray
    patch: np.ndarray
    patches: Patches

    def __len__(self) -> int:
        return len(self.corners)

    def subset(self, keep: np.ndarray) -> "Quads":
        """The quads that `keep` ([Q] bool, or numbers) picks; the patches stay."""
        return Quads(self.corners[keep], self.ends[keep], self.triangles[keep], self.patch[keep], self.patches)

    def in_order_of_patches(self) -> "Quads":
        """Stable: what lies together on a page comes together in the buffers."""
        return self.subset(np.argsort(self.patch, kind="stable"))

    def world_areas(self) -> np.ndarray:
        """[Q] float64: the two triangles' area, object units squared."""
        corners = self.corners.astype(np.float64)[np.arange(len(self))[:, None, None], self.triangles]
        sides = corners[:, :, 1:] - corners[:, :, :1]
        areas: np.ndarray = np.linalg.norm(np.cross(sides[:, :, 0], sides[:, :, 1]), axis=-1).sum(1) / 2
        return areas


def quads_of(page: Page) -> Quads | None:
    """The page's quads; None where it is made of something else than quads with patches.

    A quad is two triangles that follow each other and have four corners together, which stand on the centres of the
    corner texels of an upright rectangle.
    """
    triangles = page.triangles
    if len(triangles) % 2:
        return None
    pairs = triangles.reshape(-1, 6)
    ordered = np.sort(pairs, axis=1)
    fresh = np.concatenate([np.ones((len(pairs), 1), bool), ordered[:, 1:] != ordered[:, :-1]], 1)
    if not (fresh.sum(1) == 4).all():
        return None
    vertices = ordered[fresh].reshape(-1, 4)
    height, width = page.features_u8.shape[:2]
    at = page.texcoords[vertices].astype(np.float64) * (width, height)
    texel = np.clip(np.floor(at), 0, (width - 1, height - 1)).astype(np.int64)
    low, high = texel.min(1), texel.max(1)
    ends = (texel == high[:, None]) & (high != low)[:, None]
    upright = ((texel == low[:, None]) | (texel == high[:, None])).all() and (
        np.abs(at - texel - 0.5) < OFF_CENTRE
    ).all()
    if not (upright and (_distinct_ends(ends, high - low + 1)).all()):
        return None
    local = np.argmax(pairs[:, :, None] == vertices[:, None, :], axis=2).astype(np.uint32)
    patches = _patches(page, low, (high - low + 1)[:, ::-1])
    return Quads(page.positions[vertices], ends, local.reshape(-1, 2, 3), np.arange(len(pairs)), patches)


def _distinct_ends(ends: np.ndarray, size: np.ndarray) -> np.ndarray:
    """[Q] bool: the four corners are at different ends, as far as the patch has different ends."""
    code = ends[..., 0] + 2 * ends[..., 1]
    count = (np.sort(code, axis=1)[:, 1:] != np.sort(code, axis=1)[:, :-1]).sum(1) + 1
    expected: np.ndarray = count == np.where(size > 1, 2, 1).prod(1)
    return expected


def _patches(page: Page, low: np.ndarray, sizes: np.ndarray) -> Patches:
    """The rectangles of `sizes` [Q, 2] (height, width) that start at columns and rows `low` [Q, 2]."""
    patches = Patches(sizes, np.empty((int(sizes.prod(1).sum()), CHANNELS), np.uint8))
    page_width = page.features_u8.shape[1]
    features, colors = (
        np.ascontiguousarray(whole).reshape(-1, whole.shape[-1]) for whole in (page.features_u8, page.colors_u8)
    )
    first = low[:, 1] * page_width + low[:, 0]
    for some in patches.groups():
        height, width = sizes[some[0]]
        rows = first[some, None] + page_width * np.arange(height)
        texels = np.empty((len(some) * height * width, CHANNELS), np.uint8)
        texels[:, :FEATURE_CHANNELS] = as_bytes(windows(features, width)[rows]).reshape(-1, FEATURE_CHANNELS)
        texels[:, FEATURE_CHANNELS:] = as_bytes(windows(colors, width)[rows]).reshape(len(texels), -1)
        patches.place(some, texels.reshape(len(some), height, width, CHANNELS))
    return patches


def joined(parts: list[Quads]) -> Quads:
    """All quads of several pages; takes them from the list, so that they are in memory once."""
    shifts = np.cumsum([0, *(len(part.patches.sizes) for part in parts)])
    sizes = np.concatenate([part.patches.sizes for part in parts])
    texels, done = np.empty((int(sizes.prod(1).sum()), CHANNELS), np.uint8), 0
    others = []
    for shift in shifts[:-1]:
        part = parts.pop(0)
        texels[done : done + len(part.patches.texels)] = part.patches.texels
        done += len(part.patches.texels)
        others.append((part.corners, part.ends, part.triangles, part.patch + shift))
    corners, ends, triangles, patch = map(np.concatenate, zip(*others, strict=True))
    return Quads(corners, ends, triangles, patch, Patches(sizes, texels))
