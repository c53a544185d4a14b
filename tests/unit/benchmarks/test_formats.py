"""The table of formats says what was found, and everything of a toy scene is checked."""

from dataclasses import replace
from pathlib import Path

import moderngl
import numpy as np
import pytest

from benchmarks import format_conformance
from benchmarks.format_conformance import conformance
from benchmarks.format_fallbacks import CAPTION_PX, PHOTO, Pictures, fallbacks
from benchmarks.format_parity import Reference, parity
from benchmarks.format_rows import ConformanceRow, FallbackRow, ParityRow, table, write_results
from benchmarks.formats import spread
from core.baked import BakedScene
from core.capture import Capture, View
from core.render.composite import over, quantised
from core.render.reference import render_deferred
from exporters.gltf import write_glb
from exporters.mobilenerf import read_mobilenerf
from service.formats.source import Source

CLEAN = ConformanceRow("base", "scene.usdc", "UsdValidation", 0, 0, {"MissingShaderIdInRegistry": 92}, [])
CLOSE = ParityRow("base", "scene.glb", "its GLSL, deferred", 59.5, 0.2)
PLAIN = FallbackRow("base", "scene.glb", "glTF unlit", 25.0, 23.0)


@pytest.fixture
def views(scene: BakedScene) -> tuple[View, ...]:
    """A picture of the scene from a camera of its own."""
    camera = scene.cameras[0]
    return (View(camera, quantised(over(render_deferred(scene, camera), scene.background))),)


@pytest.fixture(scope="module")
def context() -> moderngl.Context:
    return moderngl.create_context(standalone=True, backend="egl")


@pytest.mark.parametrize("row", [CLEAN, CLOSE, PLAIN, replace(PLAIN, mean_db=5.0, goal_db=None)])
def test_goal_is_met(row: ConformanceRow | ParityRow | FallbackRow) -> None:
    assert row.goal_met


@pytest.mark.parametrize(
    "row",
    [
        replace(CLEAN, errors=1),
        replace(CLEAN, warnings=1),
        replace(CLOSE, interior_db=49.9),
        replace(CLOSE, flipped_percent=0.6),
        replace(PLAIN, mean_db=23.9),
    ],
)
def test_goal_is_missed(row: ConformanceRow | ParityRow | FallbackRow) -> None:
    assert not row.goal_met


def test_table_says_what_was_found_and_what_was_suppressed(tmp_path: Path) -> None:
    write_results(tmp_path, [CLEAN, CLOSE, PLAIN])
    write_results(tmp_path, [replace(CLOSE, interior_db=40.0)])
    text = (tmp_path / "formats.md").read_text()
    assert text == table([CLEAN, replace(CLOSE, interior_db=40.0), PLAIN])
    assert "| scene.usdc | UsdValidation | 0 | 0 | MissingShaderIdInRegistry (92) | none: met |" in text
    assert "| scene.glb | its GLSL, deferred | 40.00 | 0.200 | 50 dB, 0.5 %: missed |" in text
    assert "| scene.glb | glTF unlit | 25.00 | 23.00 | 24 dB: met |" in text
    assert "\n- MissingShaderIdInRegistry: of MaterialX's nodes alone" in text


def test_views_are_spread_over_those_held_out(views: tuple[View, ...]) -> None:
    (view,) = views
    held_out = [replace(view, camera=replace(view.camera, name=f"r_{number}")) for number in range(9)]
    held_out.append(replace(view, ignored=np.ones(view.image_u8.shape[:2], bool)))
    capture = Capture((view, view), tuple(held_out))
    assert [one.camera.name for one in spread(capture, 3, np.eye(4))] == ["r_0", "r_4", "r_8"]
    assert len(spread(capture, 50, np.eye(4))) == 9
    assert spread(replace(capture, test=()), 3, np.eye(4)) == ()


def test_every_deliverable_conforms(scene: BakedScene) -> None:
    rows = list(conformance("base", write_glb(scene)["scene.glb"], Source(scene)))
    assert len(rows) == 10
    assert all(row.goal_met for row in rows), rows


def test_layout_that_is_read_otherwise_is_noticed(scene: BakedScene, monkeypatch: pytest.MonkeyPatch) -> None:
    def read_without_background(*arguments: object) -> BakedScene:
        return replace(read_mobilenerf(*arguments), background=(0.0, 0.0, 0.0))

    monkeypatch.setattr(format_conformance, "read_mobilenerf", read_without_background)
    row = format_conformance._of_mobilenerf("base", scene, "z-up")
    assert (row.errors, row.goal_met) == (1, False)


def test_every_drawing_of_the_network_equals_the_reference(
    scene: BakedScene, views: tuple[View, ...], context: moderngl.Context
) -> None:
    glb = write_glb(scene)["scene.glb"]
    rows = list(parity("base", glb, Source(scene), [Reference(scene, view) for view in views], context))
    assert [row.name for row in rows] == ["scene.glb"] * 2 + [
        "scene.web.glb", "scene.gltf", "scene.mobilenerf.zip", "scene.usdc", "scene.usdc",
    ]  # fmt: skip
    assert all(row.goal_met for row in rows), rows


def test_fallbacks_look_alike_and_are_shown_side_by_side(
    scene: BakedScene, views: tuple[View, ...], context: moderngl.Context
) -> None:
    pictures = Pictures()
    glb = write_glb(scene)["scene.glb"]
    network, unlit, preview, phone = fallbacks("base", glb, scene, views, context, pictures)
    assert network.mean_db > 40  # its own picture
    assert unlit.mean_db == pytest.approx(preview.mean_db, abs=0.1)  # the same texels
    assert phone.goal_met  # its texels have other borders
    width, height = views[0].camera.size_px
    assert next(iter(pictures.columns)) == PHOTO
    assert pictures.side_by_side().size == (5 * width, height + CAPTION_PX)
