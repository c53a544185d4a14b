"""mlp.json: the network, in the layout's order, and under `polyfield` what the layout has no place for.

Weights are [inputs][outputs]. Other viewers read the keys they know by name; `polyfield` does not disturb them.
"""

import json
from dataclasses import dataclass
from typing import Any, cast

import numpy as np

from core.baked import BakedScene, ShaderNetwork, check_similarity
from core.camera import Camera
from core.conventions import ASSET_FROM_Z_UP
from exporters.gltf.extension import view_from_json, view_json
from exporters.invalid import invalid
from exporters.mobilenerf.axes import Axes
from exporters.numbers import column_major, matrix_from_column_major, numbers, shortest_numbers

KEY = "polyfield"
LAYERS = (0, 1, 2)
WHITE = (1.0, 1.0, 1.0)
# What view_forwardfacing.html shows at first: from the origin, 50 degrees high.
_START = Camera("start", np.eye(4), (810.6, 810.6), (504.0, 378.0), (1008, 756))


@dataclass(frozen=True)
class Setting:
    """What a scene has beside pages and network.

    Attributes:
        axes: the convention of the files.
        obj_from_object: [4, 4] float64 similarity.
        scene: the other fields of BakedScene, by name.
    """

    axes: Axes
    obj_from_object: np.ndarray
    scene: dict[str, Any]


def mlp_bytes(network: ShaderNetwork, scene: BakedScene, axes: Axes, obj_from_object: np.ndarray) -> bytes:
    """`network` is what a viewer evaluates; of `scene`, what is neither pages nor network."""
    document: dict[str, Any] = {}
    for layer, weight, bias in zip(LAYERS, network.weights, network.biases, strict=True):
        document[f"{layer}_weights"] = [shortest_numbers(row) for row in weight.T]
        document[f"{layer}_bias"] = shortest_numbers(bias)
    document["obj_num"] = len(scene.pages)
    document[KEY] = {
        "axes": axes,
        "objFromObject": column_major(obj_from_object),
        "background": [float(c) for c in scene.background],
        "assetFromObject": column_major(scene.asset_from_object),
        "userFromObject": column_major(scene.user_from_object),
        "views": [_view(camera) for camera in scene.cameras],
        "startView": scene.start_camera,
    }
    return json.dumps(document, separators=(",", ":"), allow_nan=False).encode()


def parse_mlp(data: bytes) -> dict[str, Any]:
    """The JSON object.

    Raises:
        AssetInvalid
    """
    try:
        document = json.loads(data)
    except (ValueError, RecursionError) as error:
        raise invalid("mlp.json", "must be valid JSON", str(error)[:120]) from error
    if not isinstance(document, dict):
        raise invalid("mlp.json", "must be an object", type(document).__name__)
    return document


def network_of(document: dict[str, Any]) -> ShaderNetwork:
    """As a viewer evaluates it.

    Raises:
        AssetInvalid, SceneInvalid; KeyError, ValueError for JSON of another structure.
    """
    w0, w1, w2 = (numbers(document[f"{i}_weights"], f"{i}_weights", np.float32).T.copy() for i in LAYERS)
    b0, b1, b2 = (numbers(document[f"{i}_bias"], f"{i}_bias", np.float32) for i in LAYERS)
    return ShaderNetwork((w0, w1, w2), (b0, b1, b2))


def setting_of(document: dict[str, Any], axes: Axes) -> Setting:
    """What Polyfield wrote; for files of others, what their viewers show, with the convention `axes`.

    Raises:
        AssetInvalid and its like, as above.
    """
    if KEY not in document:
        return _of_others(axes)
    found = document[KEY]
    if found["axes"] not in ("z-up", "forward"):
        raise invalid("axes", "must be z-up or forward", str(found["axes"])[:20])
    red, green, blue = numbers(found["background"], "background").tolist()
    fields = {
        "background": (red, green, blue),
        "asset_from_object": matrix_from_column_major(found["assetFromObject"], "assetFromObject"),
        "user_from_object": matrix_from_column_major(found["userFromObject"], "userFromObject"),
        "cameras": tuple(view_from_json(view, str(view["name"])) for view in found["views"]),
        "start_camera": found["startView"],
    }
    matrix = matrix_from_column_major(found["objFromObject"], "objFromObject")
    check_similarity("objFromObject", matrix)
    return Setting(cast(Axes, found["axes"]), matrix, fields)


def _view(camera: Camera) -> dict[str, Any]:
    """As in the glTF extension, with its name in place of a node."""
    return {"name": camera.name} | {key: value for key, value in view_json(camera, 0).items() if key != "node"}


def _of_others(axes: Axes) -> Setting:
    """The OBJ's frame is glTF's."""
    if axes == "z-up":
        return Setting(axes, ASSET_FROM_Z_UP.copy(), {"background": WHITE, "asset_from_object": ASSET_FROM_Z_UP.copy()})
    fields = {"background": WHITE, "asset_from_object": np.eye(4), "cameras": (_START,), "start_camera": 0}
    return Setting(axes, np.eye(4), fields)
