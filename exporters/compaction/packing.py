"""Patches of any size on pages: shelves of falling height, on as few and as small pages as will do."""

import numpy as np

from core.baked import Page
from core.conventions import FEATURE_CHANNELS, MAX_PAGE_SIZE_PX
from exporters.compaction.quads import Patches, Quads
from exporters.compaction.windows import as_items, windows
from exporters.threads import mapped

# What a further page has to save: each costs a draw call and three textures.
WORTH_A_PAGE = 1 << 19  # texels, 6 MB on the graphics processor
MOST_SPLITS = 2
COLOR_CHANNELS = 3


def packed(quads: Quads) -> tuple[Page, ...]:
    """The quads on pages; each shows the same texels as before."""
    patches = quads.patches
    order = np.lexsort((-patches.sizes[:, 1], -patches.sizes[:, 0]))
    layouts = _pages(patches.sizes, order, MOST_SPLITS)
    return tuple(mapped(lambda layout: _page(quads, layout), layouts))


Layout = tuple[tuple[int, int], np.ndarray, np.ndarray]  # page size (h, w); patch numbers; their (top, left)


def _pages(sizes: np.ndarray, order: np.ndarray, splits: int) -> list[Layout]:
    """Layouts that hold the patches `order` in turn."""
    if len(order) == 0:
        return []
    single = _smallest_page(sizes, order)
    if single is None:
        largest = (MAX_PAGE_SIZE_PX, MAX_PAGE_SIZE_PX)
        places = shelves(sizes[order], largest)
        count = len(places)
        return [(largest, order[:count], places), *_pages(sizes, order[count:], splits)]
    size, places = single
    if splits > 0 and size[0] * size[1] > 1:
        half = (size[0] // 2, size[1]) if size[0] == size[1] else (size[0], size[1] // 2)
        first = shelves(sizes[order], half)
        if len(first):
            others = _pages(sizes, order[len(first) :], splits - 1)
            texels = half[0] * half[1] + sum(h * w for (h, w), _, _ in others)
            if texels + WORTH_A_PAGE * len(others) <= size[0] * size[1]:
                return [(half, order[: len(first)], first), *others]
    return [(size, order, places)]


def _smallest_page(sizes: np.ndarray, order: np.ndarray) -> tuple[tuple[int, int], np.ndarray] | None:
    """The smallest page, square or twice as wide as high, that holds all; None if none does."""
    texels, side = int(sizes[order].prod(1).sum()), 1
    while side <= MAX_PAGE_SIZE_PX:
        for height in (side // 2, side):
            if height * side >= texels:
                places = shelves(sizes[order], (height, side))
                if len(places) == len(order):
                    return (height, side), places
        side *= 2
    return None


def shelves(sizes: np.ndarray, page: tuple[int, int]) -> np.ndarray:
    """[n, 2] (top, left) of the first n rectangles [N, 2] (h, w) of falling height that fit on a page (h, w)."""
    height, width = page
    places = np.empty((len(sizes), 2), np.int64)
    top = left = shelf = done = 0
    while done < len(sizes):
        h, w = int(sizes[done, 0]), int(sizes[done, 1])
        if left + w > width:
            top, left, shelf = top + shelf, 0, 0
        if left == 0:
            shelf = h
        if w > width or top + shelf > height:
            break
        # Runs of equal rectangles, which is nearly all of them, are placed at once.
        run = min(_run_length(sizes, done), (width - left) // w)
        places[done : done + run, 0] = top
        places[done : done + run, 1] = left + w * np.arange(run)
        done, left = done + run, left + w * run
    return places[:done]


def _run_length(sizes: np.ndarray, first: int) -> int:
    """How many rectangles from `first` on are equal, as far as one shelf may hold."""
    ahead = sizes[first : first + MAX_PAGE_SIZE_PX]
    different = np.flatnonzero((ahead != ahead[0]).any(1))
    return int(different[0]) if len(different) else len(ahead)


def _page(quads: Quads, layout: Layout) -> Page:
    """The page of those quads whose patches it holds."""
    size, numbers, places = layout
    patches = quads.patches
    slot = np.full(len(patches.sizes), -1)
    slot[numbers] = np.arange(len(numbers))
    quads = quads.subset(slot[quads.patch] >= 0)
    features, colors = _images(patches, layout, slot)
    sizes = patches.sizes[numbers]
    mine = slot[quads.patch]
    corner = places[mine][:, None, ::-1] + quads.ends * (sizes[mine][:, None, ::-1] - 1)
    texcoords = (corner + 0.5) / (size[1], size[0])
    triangles = quads.triangles + 4 * np.arange(len(quads), dtype=np.uint32)[:, None, None]
    return Page(
        features,
        colors,
        quads.corners.reshape(-1, 3),
        texcoords.reshape(-1, 2).astype(np.float32),
        triangles.reshape(-1, 3),
    )


def _images(patches: Patches, layout: Layout, slot: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(features [h, w, 8], colours [h, w, 3]), uint8, of a page; `slot` [N]: a patch's place among the layout's."""
    (height, width), numbers, places = layout
    features, colors = (np.zeros((height, width, c), np.uint8) for c in (FEATURE_CHANNELS, COLOR_CHANNELS))
    for some in patches.groups(numbers):
        texels, (top, left) = patches.content(some), places[slot[some]].T
        first = (top * width + left)[:, None] + width * np.arange(texels.shape[1])
        for image, part in ((features, texels[..., :FEATURE_CHANNELS]), (colors, texels[..., FEATURE_CHANNELS:])):
            windows(image.reshape(-1, image.shape[2]), texels.shape[2])[first] = as_items(part, 2)
    return features, colors
