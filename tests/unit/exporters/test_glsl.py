"""Shader texts: literals, the inlined network, dialects."""

import re

import moderngl
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from core.baked import BakedScene, ShaderNetwork
from exporters.glsl import PROGRAMS, VERSIONS, Dialect, shader_sources
from exporters.glsl.network import float_literal, network_function
from tests.scenes import random_network

GLSL_FLOAT = re.compile(r"-?(\d+\.\d*|\.\d+)([eE][+-]?\d+)?|-?\d+[eE][+-]?\d+")

EVALUATE = """#version 330 core
in vec4 f0; in vec4 f1; in vec3 direction; out vec3 color;
{network}
void main() {{ color = shaded(f0, f1, direction); }}
"""


@given(st.floats(width=32, allow_nan=False, allow_infinity=False))
def test_literal_reads_back_as_the_same_float32(value: float) -> None:
    text = float_literal(value)
    assert GLSL_FLOAT.fullmatch(text)
    assert np.float32(text) == np.float32(value)


@pytest.mark.parametrize(("value", "text"), [(0.1, "0.1"), (-3, "-3.0"), (0, "0.0"), (1e-5, "1e-05")])
def test_literal_is_the_shortest(value: float, text: str) -> None:
    assert float_literal(value) == text


@pytest.mark.parametrize("gain", [0.3, 1.0, 4.0])
def test_inlined_network_equals_its_numpy_oracle(rng: np.random.Generator, gain: float) -> None:
    network = random_network(rng, gain)
    features = rng.uniform(0, 1, (4096, 8)).astype("f4")
    directions = rng.normal(size=(4096, 3))
    directions = (directions / np.linalg.norm(directions, axis=-1, keepdims=True)).astype("f4")
    # float32 against float64: sums of some thirty products, steepest where the sigmoid has slope 1/4.
    np.testing.assert_allclose(_run(network, features, directions), network(features, directions), atol=2e-5 * gain)


@pytest.mark.parametrize("dialect", VERSIONS)
def test_every_program_compiles(scene: BakedScene, dialect: Dialect) -> None:
    with moderngl.create_context(standalone=True, backend="egl") as context:
        for name in PROGRAMS:
            text = shader_sources(scene.network, dialect).complete(name)
            context.program(vertex_shader=text.vertex, fragment_shader=text.fragment).release()
        assert context.error == "GL_NO_ERROR"


def test_texts_start_after_the_version_directive(scene: BakedScene) -> None:
    for dialect, version in VERSIONS.items():
        sources = shader_sources(scene.network, dialect)
        assert sources.version == version
        assert "#version" not in sources.forward.fragment
        assert sources.complete("forward").fragment.startswith(f"#version {version}\n")


def test_weights_are_inlined_not_looked_up(scene: BakedScene) -> None:
    text = shader_sources(scene.network, "essl300").shade.fragment
    assert set(re.findall(r"uniform (\w+) (\w+);", text)) == {
        ("sampler2D", "u_features0"),
        ("sampler2D", "u_features1"),
        ("mat3", "u_object_ray_from_ndc"),
    }
    # 4 blocks of 2 mat4 for features, 4 of 4 for the hidden layer; directions and outputs are narrower.
    assert (text.count("mat4("), text.count("mat3x4("), text.count("mat4x3(")) == (24, 4, 4)


def test_only_gles_declares_precision_and_it_is_high(scene: BakedScene) -> None:
    assert "precision" not in shader_sources(scene.network, "glsl330").shade.fragment
    gles = shader_sources(scene.network, "essl300")
    for program in (gles.features, gles.shade, gles.forward):
        for text in (program.vertex, program.fragment):
            assert set(re.findall(r"^precision (\w+) (\w+);", text, re.MULTILINE)) == {
                ("highp", "float"),
                ("highp", "int"),
                ("highp", "sampler2D"),
            }


def _run(network: ShaderNetwork, features: np.ndarray, directions: np.ndarray) -> np.ndarray:
    """The GLSL function on [n, 8] and [n, 3], by transform feedback: [n, 3] float32."""
    source = EVALUATE.format(network=network_function(network))
    with moderngl.create_context(standalone=True, backend="egl") as context:
        context.simple_framebuffer((1, 1)).use()  # without any, drawing is an error, even where nothing is drawn
        program = context.program(vertex_shader=source, varyings=["color"])
        inputs = context.buffer(np.concatenate([features, directions], 1).astype("f4").tobytes())
        result = context.buffer(reserve=len(features) * 12)
        array = context.vertex_array(program, [(inputs, "4f 4f 3f", "f0", "f1", "direction")])
        array.transform(result, moderngl.POINTS)
        return np.frombuffer(result.read(), "f4").reshape(-1, 3)
