"""The large scene is what it is said to be, and the table says what was measured."""

from pathlib import Path

import pytest

from benchmarks.big_scene import PATCH_PX, big_scene
from benchmarks.export import MOST_BYTES, MOST_S, ExportRow, measured, table, write_results
from core.conventions import is_opaque
from exporters.compaction.quads import quads_of
from exporters.gltf import write_glb


def test_scene_is_made_of_quads_with_patches_of_which_some_have_holes() -> None:
    scene = big_scene(pages=2, page_px=256, quads=60)
    assert scene.quad_count == 120
    for page in scene.pages:
        quads = quads_of(page)
        assert quads is not None
        assert (quads.patches.sizes == PATCH_PX).all()
        assert 0.8 < is_opaque(quads.patches.texels).mean() < 1


@pytest.mark.parametrize(("seconds", "peak", "met"), [(0, 0, True), (0.1, 0, False), (0, 1, False)])
def test_goal_is_seconds_and_memory(seconds: float, peak: int, met: bool) -> None:
    row = ExportRow("a scene", "a machine", "glb", MOST_S + seconds, 1.0, MOST_BYTES + peak, 10)
    assert row.goal_met is met


def test_row_of_a_file_is_in_the_table_once(tmp_path: Path) -> None:
    glb = write_glb(big_scene(pages=1, page_px=128, quads=9))["scene.glb"]
    (tmp_path / "scene.glb").write_bytes(glb)
    row = measured("glb", tmp_path / "scene.glb")
    assert (row.scene, row.written_bytes) == ("18 triangles; pages: 1 of 128 x 128 texels", len(glb))
    for _ in range(2):
        write_results(tmp_path, [row])
    assert (tmp_path / "export.md").read_text() == table([row])
