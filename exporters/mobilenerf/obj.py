"""Wavefront OBJ of one page: `v`, `vt` and triangles `f v/vt v/vt v/vt`."""

import numpy as np

from core.baked import Page
from exporters.invalid import invalid

# Texture coordinates come with six digits; 1 - v may leave [0, 1] by as much.
OUTSIDE = 1e-5


def obj_bytes(positions: np.ndarray, page: Page) -> bytes:
    """The page's triangles at `positions` [V, 3]; v counts from the bottom. All numbers come back exactly.

    float32 takes nine digits; 1 - v takes more where v is small.
    """
    upward = page.texcoords.astype(np.float64) * [1.0, -1.0] + [0.0, 1.0]
    corners = np.repeat(page.triangles.astype(np.int64).ravel() + 1, 2)
    text = [
        "v %.9g %.9g %.9g\n" * len(positions) % tuple(positions.ravel().tolist()),
        "vt %.9g %.17g\n" * len(upward) % tuple(upward.ravel().tolist()),
        "f %d/%d %d/%d %d/%d\n" * len(page.triangles) % tuple(corners.tolist()),
    ]
    return "".join(text).encode("ascii")


def parse_obj(files: list[bytes], subject: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(positions float32 [V, 3], texcoords float32 [V, 2] from the top, triangles uint32 [T, 3]) of a page's OBJ files.

    Raises:
        AssetInvalid
    """
    parts = [_parsed(data, subject) for data in files]
    starts = np.cumsum([0, *(len(positions) for positions, _, _ in parts)])
    triangles = [part[2] + np.uint32(start) for part, start in zip(parts, starts, strict=False)]
    return np.concatenate([p[0] for p in parts]), np.concatenate([p[1] for p in parts]), np.concatenate(triangles)


def _parsed(data: bytes, subject: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    lines: dict[bytes, list[bytes]] = {b"v": [], b"vt": [], b"f": []}
    for line in data.split(b"\n"):
        kind, _, rest = line.partition(b" ")
        if kind in lines:
            lines[kind].append(rest)
    positions = _table(lines[b"v"], 3, subject)
    texcoords = _table(lines[b"vt"], 2, subject)
    corners = _corners(lines[b"f"], len(positions), len(texcoords), subject)
    # One vertex for each pair of position and texture coordinate in use; in the layout they are the same number.
    if len(positions) == len(texcoords) and np.array_equal(corners[:, 0], corners[:, 1]):
        pairs, index = np.repeat(np.arange(len(positions))[:, None], 2, 1), corners[:, 0]
    else:
        pairs, index = np.unique(corners, axis=0, return_inverse=True)
    downward = _within(texcoords[pairs[:, 1]] * [1.0, -1.0] + [0.0, 1.0], subject)
    found = positions[pairs[:, 0]].astype(np.float32)
    return found, downward.astype(np.float32), index.reshape(-1, 3).astype(np.uint32)


def _table(rows: list[bytes], columns: int, subject: str) -> np.ndarray:
    """[rows, columns] float64."""
    tokens = b" ".join(rows).split()
    if len(tokens) != columns * len(rows):
        raise invalid(subject, f"must have {columns} numbers in each line of its kind", f"{len(tokens)} in {len(rows)}")
    try:
        return np.array(tokens, dtype=bytes).astype(np.float64).reshape(-1, columns)
    except ValueError as error:
        raise invalid(subject, "must hold numbers", str(error)[:80]) from error


def _corners(rows: list[bytes], positions: int, texcoords: int, subject: str) -> np.ndarray:
    """[3 T, 2] int64: position and texture coordinate of each corner, from 0."""
    tokens = b" ".join(rows).split()
    if len(tokens) != 3 * len(rows):
        raise invalid(subject, "must have triangles only", f"{len(tokens)} corners in {len(rows)} faces")
    pairs = [token.split(b"/")[:2] for token in tokens]
    try:
        corners = np.array(pairs, dtype=bytes).reshape(-1, 2).astype(np.int64) - 1
    except ValueError as error:  # ragged, or no numbers
        raise invalid(subject, "must give a position and a texture coordinate for each corner", "others") from error
    if len(corners) and (corners.min() < 0 or corners[:, 0].max() >= positions or corners[:, 1].max() >= texcoords):
        raise invalid(
            subject, f"must index its {positions} positions and {texcoords} texture coordinates", "indices out of range"
        )
    return corners


def _within(texcoords: np.ndarray, subject: str) -> np.ndarray:
    outside = np.abs(texcoords - np.clip(texcoords, 0.0, 1.0))
    if not (outside <= OUTSIDE).all():
        raise invalid(subject, "must have texture coordinates within [0, 1]", "others")
    clipped: np.ndarray = np.clip(texcoords, 0.0, 1.0)
    return clipped
