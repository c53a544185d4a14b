"""Packing quads into texture pages: K x K texels a quad (paper 3.3)."""

from collections.abc import Sequence

import numpy as np

from core.baked import Page
from core.conventions import MAX_PAGE_SIZE_PX

# A quad's corners 00, 01, 11, 10 in turn, as two triangles that share the diagonal 00-11.
TRIANGLES_OF_QUAD = np.array([[0, 1, 3], [0, 3, 2]])


def pack_pages(corners: np.ndarray, features_u8: np.ndarray, colors_u8: np.ndarray) -> tuple[Page, ...]:
    """Pages that hold all quads, as few and as small as will do.

    Args:
        corners: [Q, 4, 3], corners 00, 01, 10, 11 in the object frame.
        features_u8: uint8 [Q, K, K, 8], texel (i, j) at a = i / (K - 1), b = j / (K - 1).
        colors_u8: uint8 [Q, K, K, 3].
    """
    K = features_u8.shape[1]
    capacity = (MAX_PAGE_SIZE_PX // K) ** 2
    starts = range(0, len(corners), capacity)
    return tuple(_page(*(a[s : s + capacity] for a in (corners, features_u8, colors_u8))) for s in starts)


def page_size(count: int, K: int) -> tuple[int, int]:
    """(height, width) in texels: the smallest powers of two that hold `count` patches of K x K; width >= height."""
    side = 1
    while True:
        for height in (side // 2, side):
            if (height // K) * (side // K) >= count:
                return height, side
        side *= 2


def _page(corners: np.ndarray, features_u8: np.ndarray, colors_u8: np.ndarray) -> Page:
    count, K = features_u8.shape[:2]
    height, width = page_size(count, K)
    row, column = np.divmod(np.arange(count), width // K)
    return Page(
        features_u8=_image(features_u8, row * K, column * K, (height, width)),
        colors_u8=_image(colors_u8, row * K, column * K, (height, width)),
        positions=corners.reshape(-1, 3).astype(np.float32),
        texcoords=_texcoords(row * K, column * K, K, (height, width)),
        triangles=(np.arange(count)[:, None, None] * 4 + TRIANGLES_OF_QUAD).reshape(-1, 3).astype(np.uint32),
    )


def _image(patches: np.ndarray, top: np.ndarray, left: np.ndarray, size: tuple[int, int]) -> np.ndarray:
    K = patches.shape[1]
    image = np.zeros((*size, patches.shape[3]), np.uint8)
    rows = top[:, None, None] + np.arange(K)[:, None]
    columns = left[:, None, None] + np.arange(K)
    image[rows, columns] = patches
    return image


def _texcoords(top: np.ndarray, left: np.ndarray, K: int, size: tuple[int, int]) -> np.ndarray:
    """[Q * 4, 2] float32: the corners stand on the centres of the corner texels; rows run along a, columns along b."""
    a, b = np.array([0, 0, 1, 1]), np.array([0, 1, 0, 1])
    x = (left[:, None] + 0.5 + b * (K - 1)) / size[1]
    y = (top[:, None] + 0.5 + a * (K - 1)) / size[0]
    return np.stack([x, y], -1).reshape(-1, 2).astype(np.float32)


def patches_of(images: Sequence[np.ndarray], counts: Sequence[int], K: int) -> np.ndarray:
    """[Q, K, K, ...]: the patches of quads packed by `pack_pages`, out of one image per page."""
    found = []
    for image, count in zip(images, counts, strict=True):
        row, column = np.divmod(np.arange(count), image.shape[1] // K)
        rows = (row * K)[:, None, None] + np.arange(K)[:, None]
        columns = (column * K)[:, None, None] + np.arange(K)
        found.append(image[rows, columns])
    return np.concatenate(found)
