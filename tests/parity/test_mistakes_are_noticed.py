"""The comparison has teeth: shaders with a plausible mistake fail it."""

from dataclasses import replace

import moderngl
import pytest

from core.baked import BakedScene
from core.render.reference import render_deferred
from exporters.glsl import ShaderSources
from exporters.gltf import read_shaders, write_glb
from tests.parity.compare import FLIPPED_SHARE, INTERIOR_DB, compare, pixels_with_edges
from tests.parity.gl_renderer import GlRenderer

# program, right text, wrong text
MISTAKES = {
    "mirrored ray": ("shade", "vec3(ndc, 1.0)", "vec3(-ndc.x, ndc.y, 1.0)"),
    "constant direction": ("shade", "* vec3(ndc, 1.0)", "* vec3(1e-6 * ndc.x, 0.0, 1.0)"),
    "uncovered sub-pixels averaged in": ("shade", "f0 / covered, f1 / covered", "f0 / 4.0, f1 / 4.0"),
    "one sub-pixel instead of four": ("shade", "2 * pixel + ivec2(i & 1, i >> 1)", "2 * pixel"),
    "texture upside down": ("features", "floor(texcoord * ", "floor(vec2(texcoord.x, 1.0 - texcoord.y) * "),
    "rounded to the next texel": ("features", "floor(texcoord * vec2(size))", "floor(texcoord * vec2(size) + 0.5)"),
    "channels in another order": (
        "features",
        "texelFetch(u_features1, texel, 0)",
        "texelFetch(u_features1, texel, 0).bgra",
    ),
}


def with_mistake(sources: ShaderSources, program: str, right: str, wrong: str) -> ShaderSources:
    source = getattr(sources, program)
    assert right in source.fragment
    return replace(sources, **{program: replace(source, fragment=source.fragment.replace(right, wrong))})


@pytest.mark.parametrize("mistake", MISTAKES.values(), ids=MISTAKES.keys())
def test_mistake_in_a_shader_is_noticed(
    context: moderngl.Context, scene: BakedScene, mistake: tuple[str, str, str]
) -> None:
    glb = write_glb(scene)["scene.glb"]
    renderer = GlRenderer(context, glb, shaders=with_mistake(read_shaders(glb)["glsl330"], *mistake))
    camera = scene.cameras[0]
    comparison = compare(
        renderer.render(camera, "deferred"), render_deferred(scene, camera), pixels_with_edges(scene, camera)
    )
    assert comparison.interior_psnr < INTERIOR_DB or comparison.flipped_share > FLIPPED_SHARE, str(comparison)
