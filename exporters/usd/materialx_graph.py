"""The shader network as a graph of MaterialX's standard nodes: every weight a constant of it, nothing baked.

Vectors are float4, matrices 4 x 4, so 16 hidden units are four vectors. The view direction becomes a float4 with w = 1,
whose matrix carries the first layer's bias in its last column.

Texture coordinates are moved to the middle of their texel, so that a texture's filter does not matter.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from core.baked import ShaderNetwork

LANES = 4
BIAS_LANE = 3  # of the direction
LARGEST_LOGIT = 40.0  # there the sigmoid has long reached 0 or 1, and exp does not overflow
SMALLEST_OPAQUE = 0.5 / 255  # between byte 0, a hole, and byte 1
FEATURE_IMAGES = ("features0", "features1")
PAGE_SIZE = "pageSize"  # the node that holds a page's (width, height)


@dataclass(frozen=True)
class Node:
    """One node.

    Attributes:
        name: unique in its graph.
        definition: MaterialX's node definition, e.g. "ND_add_vector4".
        output: type of its only output, `out`.
        inputs: by name, MaterialX's type, and a constant of it or a Node whose output it is. A matrix [4, 4] acts on
            columns.
    """

    name: str
    definition: str
    output: str
    inputs: dict[str, tuple[str, Any]]


@dataclass(frozen=True)
class Graph:
    """Nodes, each after those it depends on, and what the graph is for.

    Attributes:
        color: linear Rec. 709 colour, color3.
        alpha: 0 in holes, 1 elsewhere, float.
    """

    nodes: tuple[Node, ...]
    color: Node
    alpha: Node


def network_graph(network: ShaderNetwork) -> Graph:
    """The graph of a network. `ShaderNetwork.__call__`, followed by decoding sRGB, is its oracle.

    What differs from page to page has defaults in it: the files of FEATURE_IMAGES and the value of PAGE_SIZE.
    """
    b = _Builder()
    features = _features(b)
    red = b.add("hole_feature", "extract_vector4", "float", {"in": ("vector4", features[0]), "index": ("integer", 0)})
    threshold = {"value1": ("float", red), "value2": ("float", SMALLEST_OPAQUE)}
    alpha = b.add("alpha", "ifgreater_float", "float", threshold | {"in1": ("float", 1.0), "in2": ("float", 0.0)})
    (w0, w1, w2), (b0, b1, b2) = network.weights, network.biases
    hidden = b.layer("first", np.concatenate([w0, b0[:, None]], 1), [*features, _direction(b)])
    hidden = b.layer("second", w1, hidden, b1)
    # Its negative, as the sigmoid needs it. The fourth row is spare.
    logit = b.affine("minus_logit", np.vstack([-w2, np.zeros((1, 16))]), hidden, np.append(-b2, 0.0))
    color = _linear(b, _sigmoid(b, logit))
    return Graph(tuple(b.nodes), color, alpha)


class _Builder:
    """Collects nodes."""

    def __init__(self) -> None:
        self.nodes: list[Node] = []

    def add(self, name: str, definition: str, output: str, inputs: dict[str, tuple[str, Any]]) -> Node:
        node = Node(name, f"ND_{definition}", output, inputs)
        self.nodes.append(node)
        return node

    def of_vectors(self, name: str, operation: str, first: Any, second: Any, kind: str = "vector4") -> Node:
        """`operation` of two vectors of a kind."""
        return self.add(name, f"{operation}_{kind}", kind, {"in1": (kind, first), "in2": (kind, second)})

    def layer(self, name: str, weight: np.ndarray, inputs: list[Node], bias: np.ndarray | None = None) -> list[Node]:
        """max(weight * inputs + bias, 0), four rows a node."""
        outputs = []
        for block, rows in enumerate(_blocks(len(weight))):
            total = self.affine(f"{name}{block}", weight[rows], inputs, None if bias is None else bias[rows])
            relu = {"in1": ("vector4", total), "in2": ("float", 0.0)}
            outputs.append(self.add(f"{name}{block}_relu", "max_vector4FA", "vector4", relu))
        return outputs

    def affine(self, name: str, weight: np.ndarray, inputs: list[Node], bias: np.ndarray | None) -> Node:
        """weight [4, 4 n] * inputs (n vectors) + bias [4]."""
        total: Any = None if bias is None else np.asarray(bias, np.float32)
        for i, (vector, columns) in enumerate(zip(inputs, _blocks(weight.shape[1]), strict=True)):
            product = {"in": ("vector4", vector), "mat": ("matrix44", weight[:, columns])}
            term = self.add(f"{name}_product{i}", "transformmatrix_vector4", "vector4", product)
            total = term if total is None else self.of_vectors(f"{name}_sum{i}", "add", total, term)
        found: Node = total
        return found


def _blocks(count: int) -> list[slice]:
    return [slice(start, start + LANES) for start in range(0, count, LANES)]


def _features(b: _Builder) -> list[Node]:
    """Features 0-3 and 4-7 of the nearest texel."""
    st = b.add("st", "geompropvalue_vector2", "vector2", {"geomprop": ("string", "st")})
    size = b.add(PAGE_SIZE, "constant_vector2", "vector2", {"value": ("vector2", (1.0, 1.0))})
    corner = b.of_vectors("texel_place", "multiply", st, size, "vector2")
    corner = b.add("texel_corner", "floor_vector2", "vector2", {"in": ("vector2", corner)})
    middle = b.of_vectors("texel_middle", "add", corner, (0.5, 0.5), "vector2")
    middle = b.of_vectors("texel", "divide", middle, size, "vector2")
    lookup = {
        "texcoord": ("vector2", middle),
        "uaddressmode": ("string", "clamp"),
        "vaddressmode": ("string", "clamp"),
        "filtertype": ("string", "closest"),
    }
    return [b.add(name, "image_vector4", "vector4", {"file": ("filename", ""), **lookup}) for name in FEATURE_IMAGES]


def _direction(b: _Builder) -> Node:
    """(direction, 1): from the camera to the point, unit, in the object frame."""
    # Asked for it in object space, MaterialX's GLSL turns the wrong way (1.39.5: by the inverse transpose).
    world = b.add("view_world", "viewdirection_vector3", "vector3", {"space": ("string", "world")})
    spaces = {"fromspace": ("string", "world"), "tospace": ("string", "object")}
    turned = b.add("view_object", "transformvector_vector3", "vector3", {"in": ("vector3", world), **spaces})
    unit = b.add("direction", "normalize_vector3", "vector3", {"in": ("vector3", turned)})
    with_one = {"in1": ("vector3", unit), "in2": ("float", 1.0)}
    return b.add("direction_and_one", "combine2_vector4VF", "vector4", with_one)


def _sigmoid(b: _Builder, minus_logit: Node) -> Node:
    limits = {"low": ("float", -LARGEST_LOGIT), "high": ("float", LARGEST_LOGIT)}
    clamped = b.add("clamped", "clamp_vector4FA", "vector4", {"in": ("vector4", minus_logit), **limits})
    power = b.add("exp", "exp_vector4", "vector4", {"in": ("vector4", clamped)})
    ones = (1.0, 1.0, 1.0, 1.0)
    return b.of_vectors("sigmoid", "divide", ones, b.of_vectors("one_and_exp", "add", power, ones))


def _linear(b: _Builder, srgb: Node) -> Node:
    """Linear colour of sRGB in x, y, z."""
    channels = {
        f"in{i + 1}": (
            "float",
            b.add(name, "extract_vector4", "float", {"in": ("vector4", srgb), "index": ("integer", i)}),
        )
        for i, name in enumerate(("red", "green", "blue"))
    }
    color = b.add("srgb", "combine3_color3", "color3", channels)
    return b.add("linear", "srgb_texture_to_lin_rec709_color3", "color3", {"in": ("color3", color)})
