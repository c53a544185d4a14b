"""The table of sizes says what was measured."""

from pathlib import Path

import numpy as np
import pytest

from benchmarks.size import PLAIN, UNIFORM, SizeRow, goal_met, measured, table, write_results
from benchmarks.uniform_layout import PAPER_K, watched_for_uniform_layout
from core.baked import BakedScene
from core.capture import View
from core.reconstruct import reconstruct
from core.render.composite import over, quantised
from core.render.reference import render_deferred
from exporters.compaction.quads import quads_of
from service.formats import FORMATS
from service.formats.measure import Measure
from service.formats.source import Source
from tests.unit.benchmarks.toy import HASTY, small_survey
from tests.unit.training.captures import ball, capture_of


def row(name: str, size: int, psnr: float) -> SizeRow:
    return SizeRow("base", name, size, psnr, 10, 4096, 1, 0.5)


@pytest.fixture
def views(scene: BakedScene) -> tuple[View, ...]:
    """Pictures of the scene from its own cameras."""
    return tuple(
        View(camera, quantised(over(render_deferred(scene, camera), scene.background))) for camera in scene.cameras[:1]
    )


@pytest.mark.parametrize(("size", "psnr", "met"), [(40, 29.8, True), (41, 30.0, False), (20, 29.7, False)])
def test_goal_is_bytes_and_decibels(size: int, psnr: float, met: bool) -> None:
    known = {UNIFORM: row(UNIFORM, 100, 28.0), PLAIN: row(PLAIN, 60, 30.0)}
    assert goal_met(row("scene.web.glb", size, psnr), known) is met


def test_other_files_have_no_goal() -> None:
    known = {UNIFORM: row(UNIFORM, 100, 28.0), PLAIN: row(PLAIN, 200, 30.0)}
    assert all(goal_met(one, known) for one in known.values())


def test_table_has_share_and_loss(tmp_path: Path) -> None:
    rows = [
        row(UNIFORM, 100, 28.0),
        row(PLAIN, 60, 30.0),
        row("scene.web.glb", 25, 29.95),
        row("viewer.zip", 70, 29.95),
    ]
    write_results(tmp_path, rows)
    text = (tmp_path / "size.md").read_text()
    assert text == table(rows)
    (line,) = (line for line in text.splitlines() if line.startswith("| scene.web.glb"))
    assert "| 25.0 % | 29.95 | -0.05 | 40 %, -0.2 dB: met |" in line


@pytest.mark.parametrize("name", ["glb", "web", "usd", "ply"])
def test_deliverable_is_measured_on_its_file(scene: BakedScene, views: tuple[View, ...], name: str) -> None:
    measure = Measure(views, scene.user_from_object, scene.background)
    found = measured("base", "name", FORMATS[name], Source(scene), measure)
    # Its own pictures: what rounding leaves; of baked colours, little is left of a random network.
    least = {"glb": 45, "web": 40, "usd": 45, "ply": 5}[name]
    assert found.psnr > least
    assert found.bytes == len(FORMATS[name].write(Source(scene)))
    assert found.quads > 0


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
