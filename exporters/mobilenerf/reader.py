"""A scene in MobileNeRF's layout, whoever wrote it."""

import re
from collections.abc import Mapping
from typing import Any

import numpy as np

from core.baked import BakedScene, Page
from core.errors import AssetInvalid
from exporters.fallback import mean_colors
from exporters.invalid import invalid, only_asset_invalid
from exporters.limits import MAX_PAGES, check_size
from exporters.mobilenerf.alpha import as_shown
from exporters.mobilenerf.axes import Axes, guessed_axes, inverse, moved, network_from_object, turned
from exporters.mobilenerf.mlp import network_of, parse_mlp, setting_of
from exporters.mobilenerf.obj import parse_obj
from exporters.png import decode_pngs, png_size

_MLP = "mlp.json"


def read_mobilenerf(files: Mapping[str, bytes], axes: Axes | None = None) -> BakedScene:
    """The scene of `mlp.json` and its shapes; shapes may be split into `shape{i}_{j}.obj`, as the hosted demos are.

    The layout has no colours for viewers without the network: they are estimated by running it.

    Args:
        files: by name; all in one folder, which may be part of the names.
        axes: the axis convention of files that Polyfield did not write; guessed from the geometry if None.

    Raises:
        AssetInvalid: damaged, incomplete, or not files of this kind. Nothing else, whatever the bytes.
    """
    with only_asset_invalid(_MLP):
        files = _of_the_folder(files)
        document = parse_mlp(files[_MLP])
        network = network_of(document)
        shapes = [_Shape(files, number) for number in range(_shape_count(document))]
        check_size((shape.size for shape in shapes), AssetInvalid)
        meshes = [parse_obj(shape.objs, f"{shape.name}.obj") for shape in shapes]
        setting = setting_of(document, axes or guessed_axes(np.concatenate([positions for positions, _, _ in meshes])))
        object_from_obj = inverse(setting.obj_from_object)
        network = turned(network, network_from_object(setting.axes, setting.obj_from_object).T)
        pages = []
        for shape, (positions, texcoords, triangles) in zip(shapes, meshes, strict=True):
            features_u8 = as_shown(*decode_pngs(shape.pngs, f"{shape.name}'s textures"))
            colors_u8 = mean_colors(network, features_u8)
            pages.append(Page(features_u8, colors_u8, moved(positions, object_from_obj), texcoords, triangles))
        return BakedScene(tuple(pages), network, **setting.scene)


class _Shape:
    """The files of one page, and what their headers say.

    Attributes:
        name: "shape0".
        objs: its OBJ, or its parts in order.
        pngs: features 0-3, features 4-7.
        size: (height, width) of both.
    """

    def __init__(self, files: Mapping[str, bytes], number: int) -> None:
        self.name = f"shape{number}"
        self.objs = _objs(files, self.name)
        self.pngs = [_file(files, f"{self.name}.pngfeat{half}.png") for half in range(2)]
        sizes = [png_size(png, f"{self.name}'s texture") for png in self.pngs]
        if sizes[0] != sizes[1]:
            raise invalid(f"{self.name}'s textures", "must have one size", str(sizes))
        self.size = sizes[0]


def _of_the_folder(files: Mapping[str, bytes]) -> dict[str, bytes]:
    """The files beside mlp.json, by their names within its folder."""
    folders = [name.removesuffix(_MLP) for name in files if name == _MLP or name.endswith(f"/{_MLP}")]
    if len(folders) != 1:
        raise invalid("files", f"must have one {_MLP}", f"{len(folders)}")
    return {name.removeprefix(folders[0]): data for name, data in files.items() if name.startswith(folders[0])}


def _shape_count(document: dict[str, Any]) -> int:
    count = document.get("obj_num")
    if type(count) is not int or not 1 <= count <= MAX_PAGES:
        raise invalid("obj_num", f"must be 1 to {MAX_PAGES}", str(count)[:20])
    return count


def _objs(files: Mapping[str, bytes], name: str) -> list[bytes]:
    if f"{name}.obj" in files:
        return [files[f"{name}.obj"]]
    parts = {
        int(match[1]): data for file, data in files.items() if (match := re.fullmatch(rf"{name}_(\d+)\.obj", file))
    }
    if sorted(parts) != list(range(len(parts))) or not parts:
        raise invalid(
            "files", f"must have {name}.obj, or {name}_0.obj and all that follow", f"parts {sorted(parts)}"[:80]
        )
    return [parts[index] for index in sorted(parts)]


def _file(files: Mapping[str, bytes], name: str) -> bytes:
    if name not in files:
        raise invalid("files", f"must have {name}", f"{len(files)} others")
    return files[name]
