"""Wavefront OBJ and MTL, with the mean colours as PNG textures and a mask that cuts out the holes.

The mask is a file of its own with four equal channels: of `map_d`, programs take alpha, red or green.
"""

from collections.abc import Iterator

import numpy as np

from core.baked import BakedScene, Page
from core.conventions import is_opaque
from core.errors import SceneInvalid
from exporters.compaction.filling import filled
from exporters.limits import check_size
from exporters.plain.placed import placed
from exporters.png import encode_pngs

OBJ_NAME, MTL_NAME = "scene.obj", "scene.mtl"
BAND_PX = 256  # rows whose holes are filled at a time: 0.1 GB of a full page
LINES_AT_ONCE = 1 << 16
# Lit by nothing: illum 0 shows Kd as it is. Programs that light everything find it matt.
_MATERIAL = """newmtl {name}
Ka 0 0 0
Kd 1 1 1
Ks 0 0 0
d 1
illum 0
map_Kd {color}
map_d {mask}
"""


def write_obj(scene: BakedScene) -> dict[str, bytes]:
    """`scene.obj`, `scene.mtl`, and of each page `scene.page{i}.png` (RGBA) and `scene.page{i}.mask.png`.

    An object for each page; its triangles are all there, in order. Corners at one place share a vertex (`v`), each has
    its texture coordinate (`vt`, from the bottom). Seven digits a number. Holes are in the texture's alpha and in the
    mask; their colour is that of a texel beside them, so that filtering and programs without alpha show no black.

    Raises:
        SceneInvalid: the pages exceed what a reader accepts.
    """
    check_size([page.features_u8.shape[:2] for page in scene.pages], SceneInvalid)
    names = [f"scene.page{number}" for number in range(len(scene.pages))]
    pngs = encode_pngs([image for page in scene.pages for image in _images(page)])
    files = {OBJ_NAME: b"".join(_lines(scene, names)), MTL_NAME: _materials(names)}
    for number, name in enumerate(names):
        files[_color_name(name)], files[_mask_name(name)] = pngs[2 * number : 2 * number + 2]
    return files


def _images(page: Page) -> tuple[np.ndarray, np.ndarray]:
    """Colours and mask, uint8 [h, w, 4]."""
    opaque = is_opaque(page.features_u8)
    mask = np.where(opaque, np.uint8(255), np.uint8(0))[..., None]
    bands = [
        filled(page.colors_u8[None, row : row + BAND_PX], opaque[None, row : row + BAND_PX])[0]
        for row in range(0, len(opaque), BAND_PX)
    ]
    return np.concatenate([np.concatenate(bands), mask], -1), np.repeat(mask, 4, -1)


def _lines(scene: BakedScene, names: list[str]) -> Iterator[bytes]:
    yield f"# +y up\nmtllib {MTL_NAME}\n".encode()
    vertices_before = texcoords_before = 0
    for page, name in zip(scene.pages, names, strict=True):
        vertices, number = np.unique(placed(scene, page) + 0.0, axis=0, return_inverse=True)
        upward = page.texcoords.astype(np.float64) * [1.0, -1.0] + [0.0, 1.0]
        triangles = page.triangles.astype(np.int64)
        corners = np.stack(
            [number.ravel()[triangles] + 1 + vertices_before, triangles + 1 + texcoords_before], -1
        ).reshape(-1, 6)
        yield f"o {name}\n".encode()
        yield from _formatted("v %.7g %.7g %.7g\n", vertices)
        yield from _formatted("vt %.7g %.7g\n", upward)
        yield f"usemtl {name}\n".encode()
        yield from _formatted("f %d/%d %d/%d %d/%d\n", corners)
        vertices_before += len(vertices)
        texcoords_before += len(upward)


def _formatted(line: str, rows: np.ndarray) -> Iterator[bytes]:
    for first in range(0, len(rows), LINES_AT_ONCE):
        some = rows[first : first + LINES_AT_ONCE]
        yield (line * len(some) % tuple(some.ravel().tolist())).encode("ascii")


def _materials(names: list[str]) -> bytes:
    return "\n".join(
        _MATERIAL.format(name=name, color=_color_name(name), mask=_mask_name(name)) for name in names
    ).encode()


def _color_name(name: str) -> str:
    return f"{name}.png"


def _mask_name(name: str) -> str:
    return f"{name}.mask.png"
