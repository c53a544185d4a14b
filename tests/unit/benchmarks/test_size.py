"""The table of sizes says what was measured."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from benchmarks.size import DELIVERABLES, PLAIN, UNIFORM, SizeRow, goal_met, in_frame_of, measured, table, write_results
from benchmarks.uniform_layout import PAPER_K, watched_for_uniform_layout
from core.baked import BakedScene
from core.capture import View
from core.reconstruct import reconstruct
from core.render.composite import over, quantised
from core.render.reference import render_deferred
from exporters.compaction.quads import quads_of
from exporters.gltf import read_glb, write_web_glb
from tests.unit.benchmarks.toy import HASTY, small_survey
from tests.unit.training.captures import ball, capture_of


def row(name: str, size: int, psnr: float | None) -> SizeRow:
    return SizeRow("base", name, size, psnr, 10, 4096, 1, 0.5)


@pytest.fixture
def views(scene: BakedScene) -> tuple[View, ...]:
    """Pictures of the scene from its own cameras."""
    return tuple(
        View(camera, quantised(over(render_deferred(scene, camera), scene.background))) for camera in scene.cameras[:1]
    )


@pytest.mark.parametrize(
    ("size", "psnr", "met"), [(40, 29.8, True), (41, 30.0, False), (20, 29.7, False), (40, None, True)]
)
def test_goal_is_bytes_and_decibels(size: int, psnr: float | None, met: bool) -> None:
    known = {UNIFORM: row(UNIFORM, 100, 28.0), PLAIN: row(PLAIN, 60, 30.0)}
    assert goal_met(row("scene.web.glb", size, psnr), known) is met


def test_other_files_have_no_goal() -> None:
    known = {UNIFORM: row(UNIFORM, 100, 28.0), PLAIN: row(PLAIN, 200, 30.0)}
    assert all(goal_met(one, known) for one in known.values())


def test_table_has_share_and_loss(tmp_path: Path) -> None:
    rows = [row(UNIFORM, 100, 28.0), row(PLAIN, 60, 30.0), row("scene.web.glb", 25, 29.95), row("viewer.zip", 70, None)]
    write_results(tmp_path, rows)
    text = (tmp_path / "size.md").read_text()
    assert text == table(rows)
    (line,) = (line for line in text.splitlines() if line.startswith("| scene.web.glb"))
    assert "| 25.0 % | 29.95 | -0.05 | 40 %, -0.2 dB: met |" in line


def test_every_deliverable_is_measured_alike(scene: BakedScene, views: tuple[View, ...]) -> None:
    found = {one.name: measured("base", one, scene, views, "cpu") for one in DELIVERABLES}
    assert found[PLAIN].psnr is not None
    # Its own pictures: what rounding leaves.
    assert found[PLAIN].psnr > 45
    assert found["neural USD"].psnr == pytest.approx(found[PLAIN].psnr, abs=1.0)
    web = found["scene.web.glb"]
    assert web.psnr is not None
    assert 40 < web.psnr < found[PLAIN].psnr
    assert web.bytes < found[PLAIN].bytes
    assert found["viewer.html"].psnr is None


def test_views_follow_the_frame_of_what_is_read(scene: BakedScene, views: tuple[View, ...]) -> None:
    held = read_glb(write_web_glb(scene)["scene.web.glb"])
    (moved,) = in_frame_of(views, scene, held)
    np.testing.assert_allclose(moved.camera.position, held.cameras[0].position, atol=1e-9)
    (same,) = in_frame_of(views, scene, replace(held, cameras=()))
    assert same.camera is views[0].camera


def test_uniform_layout_is_that_of_the_paper_and_training_goes_on_as_ever() -> None:
    capture = capture_of(ball())
    with small_survey():
        plain = reconstruct(capture, HASTY, device="cpu").scene
        with watched_for_uniform_layout(capture) as layout:
            watched = reconstruct(capture, HASTY, device="cpu").scene
    assert layout.scene is not None
    for page in layout.scene.pages:
        quads = quads_of(page)
        assert quads is not None
        assert (quads.patches.sizes == PAPER_K).all()
    for page, other in zip(plain.pages, watched.pages, strict=True):
        np.testing.assert_array_equal(page.features_u8, other.features_u8)
