"""The shader network as GLSL: weights inlined, products as mat4 and vec4 arithmetic (MobileNeRF, supplement B)."""

import numpy as np

from core.baked import ShaderNetwork

BLOCK = 4  # a vec4's lanes: 16 hidden units are four of them


def float_literal(value: float) -> str:
    """The shortest GLSL literal that reads back as the same float32, e.g. `0.1`, `-3.0`, `1e-05`."""
    text = str(np.float32(value))
    return text if "." in text or "e" in text else f"{text}.0"


def network_function(network: ShaderNetwork) -> str:
    """GLSL of `vec3 shaded(vec4 f0, vec4 f1, vec3 direction)`: eq. 5, sRGB in [0, 1].

    `f0`, `f1` are features 0-3 and 4-7, `direction` a unit vector in the object frame. `ShaderNetwork.__call__` is its
    oracle.
    """
    (w0, w1, w2), (b0, b1, b2) = network.weights, network.biases
    inputs = (("f0", 0, 4), ("f1", 4, 8), ("direction", 8, 11))
    hidden = tuple((f"a{i}", BLOCK * i, BLOCK * (i + 1)) for i in range(len(b0) // BLOCK))
    hidden2 = tuple((f"b{i}", start, stop) for i, (_, start, stop) in enumerate(hidden))
    lines = ["vec3 shaded(vec4 f0, vec4 f1, vec3 direction) {"]
    for name, start, stop in hidden:
        lines.append(f"    vec4 {name} = max({_affine(w0[start:stop], b0[start:stop], inputs)}, 0.0);")
    for name, start, stop in hidden2:
        lines.append(f"    vec4 {name} = max({_affine(w1[start:stop], b1[start:stop], hidden)}, 0.0);")
    lines.append(f"    vec3 logit = {_affine(w2, b2, hidden2)};")
    # exp overflows beyond 88; at 40 the sigmoid has long reached 0 or 1.
    lines.append("    return 1.0 / (1.0 + exp(-clamp(logit, -40.0, 40.0)));")
    lines.append("}")
    return "\n".join(lines) + "\n"


def _affine(weight: np.ndarray, bias: np.ndarray, inputs: tuple[tuple[str, int, int], ...]) -> str:
    """`bias + mat * x + ...` over the named slices (name, start, stop) of the input; weight [rows, columns]."""
    terms = [_vector(bias)]
    terms += [f"{_matrix(weight[:, start:stop])} * {name}" for name, start, stop in inputs]
    return "\n        + ".join(terms)


def _vector(values: np.ndarray) -> str:
    return f"vec{len(values)}({_literals(values)})"


def _matrix(values: np.ndarray) -> str:
    """`mat4(...)` or `matCxR(...)`; GLSL lists columns first."""
    rows, columns = values.shape
    kind = "mat4" if rows == columns == BLOCK else f"mat{columns}x{rows}"
    return f"{kind}({_literals(values.T)})"


def _literals(values: np.ndarray) -> str:
    return ", ".join(float_literal(value) for value in np.ravel(values))
