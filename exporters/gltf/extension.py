"""The vendor extension's JSON. Specification: docs/extensions/POLYFIELD_materials_neural/README.md."""

from dataclasses import asdict
from typing import Any

import numpy as np

from core.baked import ShaderNetwork
from core.camera import Camera
from exporters.glsl import PROGRAMS, VERSIONS, Program, ShaderSources, shader_sources
from exporters.invalid import invalid
from exporters.numbers import column_major, matrix_from_column_major, numbers, shortest_numbers

NAME = "POLYFIELD_materials_neural"
CODING = "unorm8"
ACTIVATIONS = ("relu", "relu", "sigmoid")


def primitive_json(feature_textures: tuple[int, int], network: int = 0) -> dict[str, Any]:
    """The extension of a mesh primitive whose features are in two textures, given by index."""
    textures = [{"index": index} for index in feature_textures]
    return {"network": network, "featureTextures": textures, "coding": CODING}


def network_json(network: ShaderNetwork) -> dict[str, Any]:
    """Normative weights, and shader texts in every dialect."""
    layers = [
        {"weights": [shortest_numbers(row) for row in weight], "bias": shortest_numbers(bias), "activation": activation}
        for weight, bias, activation in zip(network.weights, network.biases, ACTIVATIONS, strict=True)
    ]
    shaders = {dialect: _sources_json(shader_sources(network, dialect)) for dialect in VERSIONS}
    return {"layers": layers, "shaders": shaders}


def view_json(camera: Camera, node: int) -> dict[str, Any]:
    """A camera of the capture, exactly; `node` carries glTF's approximation of it."""
    return {
        "node": node,
        "imageSize": [int(n) for n in camera.size_px],
        "focalLength": [float(n) for n in camera.focal_px],
        "principalPoint": [float(n) for n in camera.centre_px],
        "objectFromCamera": column_major(camera.world_from_camera),
    }


def network_from_json(json: dict[str, Any]) -> ShaderNetwork:
    """The network of its JSON; float32 numbers come back exactly.

    Raises:
        AssetInvalid; SceneInvalid for wrong shapes or numbers that are not finite.
        KeyError, TypeError, ValueError for JSON of another structure.
    """
    layers = json["layers"]
    activations = tuple(layer["activation"] for layer in layers)
    if activations != ACTIVATIONS:
        raise invalid("network", f"must have the activations {ACTIVATIONS}", str(activations)[:80])
    w0, w1, w2 = (numbers(layer["weights"], "network weights", np.float32) for layer in layers)
    b0, b1, b2 = (numbers(layer["bias"], "network biases", np.float32) for layer in layers)
    return ShaderNetwork((w0, w1, w2), (b0, b1, b2))


def view_from_json(json: dict[str, Any], name: str) -> Camera:
    """The camera of a view.

    Raises:
        AssetInvalid; PosesInvalid, PoseNotRigid or PoseNotFinite from the camera's own rules.
        KeyError, TypeError, ValueError for JSON of another structure.
    """
    fx, fy = numbers(json["focalLength"], "view's focal length").tolist()
    cx, cy = numbers(json["principalPoint"], "view's principal point").tolist()
    width, height = numbers(json["imageSize"], "view's image size").tolist()
    pose = matrix_from_column_major(json["objectFromCamera"], "view's pose")
    return Camera(name, pose, (fx, fy), (cx, cy), (int(width), int(height)))


def shaders_from_json(json: dict[str, Any]) -> dict[str, ShaderSources]:
    """Shader texts by dialect, as stored; empty where the asset has none.

    Raises:
        KeyError, TypeError, ValueError for JSON of another structure.
    """
    shaders = {}
    for dialect, sources in json.get("shaders", {}).items():
        programs = [sources["programs"][name] for name in PROGRAMS]
        texts = [Program(str(program["vertex"]), str(program["fragment"])) for program in programs]
        shaders[str(dialect)] = ShaderSources(str(sources["version"]), *texts)
    return shaders


def _sources_json(sources: ShaderSources) -> dict[str, Any]:
    return {"version": sources.version, "programs": {name: asdict(getattr(sources, name)) for name in PROGRAMS}}
