"""Plain meshes, as programs read them."""

import io
from collections.abc import Mapping

import numpy as np
from PIL import Image

from core.errors import AssetInvalid
from service.formats.colours import Coloured, Textured, scene_of_colours

_OPAQUE = np.full((1, 1, 4), 255, np.uint8)
_VERTEX = np.dtype([("position", "<f4", 3), ("color", "u1", 3)])
_FACE = np.dtype([("count", "u1"), ("corners", "<i4", 3)])


def read_obj(files: Mapping[str, bytes]) -> Coloured:
    """The objects of `scene.obj` and their textures `map_Kd`.

    Raises:
        AssetInvalid
    """
    try:
        textures = _textures(files["scene.mtl"].decode())
        parts = files["scene.obj"].decode("ascii").split("\no ")[1:]
        meshes: list[Textured] = []
        vertices, texcoords = np.zeros((0, 3)), np.zeros((0, 2))
        for part in parts:
            lines = part.split("\n")[1:]
            vertices = np.concatenate([vertices, _numbers(lines, "v ", 3)])
            texcoords = np.concatenate([texcoords, _numbers(lines, "vt ", 2)])
            (material,) = [line.removeprefix("usemtl ") for line in lines if line.startswith("usemtl ")]
            corners = _numbers([line.replace("/", " ") for line in lines if line.startswith("f ")], "f ", 6)
            corner, texcoord = (corners.reshape(-1, 2).astype(np.int64) - 1).T
            rgba_u8 = np.asarray(Image.open(io.BytesIO(files[textures[material]])).convert("RGBA"))
            downward = np.clip(texcoords[texcoord] * [1, -1] + [0, 1], 0, 1)
            triangles = np.arange(len(corner), dtype=np.uint32).reshape(-1, 3)
            meshes.append((rgba_u8, vertices[corner].astype(np.float32), downward.astype(np.float32), triangles))
    except (KeyError, ValueError, OSError) as error:
        raise AssetInvalid("scene.obj", "must be objects with a texture each", str(error)[:120]) from error
    return Coloured(scene_of_colours(meshes, np.eye(4)), "asset")


def read_ply(data: bytes) -> Coloured:
    """Vertices with colours.

    Raises:
        AssetInvalid
    """
    try:
        head, body = data.split(b"end_header\n", 1)
        counts = {line.split()[1]: int(line.split()[2]) for line in head.split(b"\n") if line.startswith(b"element ")}
        vertices = np.frombuffer(body, _VERTEX, counts[b"vertex"])
        faces = np.frombuffer(body, _FACE, counts[b"face"], vertices.nbytes)
        if not (faces["count"] == 3).all():
            raise ValueError("faces that are no triangles")
    except (KeyError, IndexError, ValueError) as error:
        raise AssetInvalid("scene.ply", "must be triangles with colours at their vertices", str(error)[:120]) from error
    texcoords = np.zeros((len(vertices), 2), np.float32)
    mesh = (_OPAQUE, vertices["position"].copy(), texcoords, faces["corners"].astype(np.uint32))
    scene = scene_of_colours([mesh], np.eye(4))
    return Coloured(scene, "asset", vertex_colors_u8=(vertices["color"].copy(),))


def _textures(mtl: str) -> dict[str, str]:
    """Material to the file of its colours."""
    found, name = {}, ""
    for line in mtl.splitlines():
        if line.startswith("newmtl "):
            name = line.removeprefix("newmtl ")
        elif line.startswith("map_Kd "):
            found[name] = line.removeprefix("map_Kd ")
    return found


def _numbers(lines: list[str], start: str, columns: int) -> np.ndarray:
    """[n, columns] float64 of the lines that start so."""
    text = " ".join(line[len(start) :] for line in lines if line.startswith(start))
    return np.array(text.split(), np.float64).reshape(-1, columns)
