"""Whether validators find nothing in any deliverable of a scene, and MobileNeRF's layout comes back."""

import tempfile
from collections.abc import Iterator, Mapping
from importlib.metadata import version
from pathlib import Path
from typing import Any, get_args

from benchmarks.format_rows import ConformanceRow
from core.baked import BakedScene
from exporters.gltf import write_gltf, write_lq_glb
from exporters.mobilenerf import Axes, read_mobilenerf, write_mobilenerf
from exporters.usd import write_usd
from exporters.usd.quicklook import write_quicklook
from exporters.usd.writer import Form
from service.formats.source import Source
from tests.conformance.gltf_validation import ERROR, WARNING, messages_of, validated_file
from tests.conformance.usd_validation import findings
from tests.unit.exporters.equality import as_kept_by_mobilenerf, assert_equal, assert_equal_within_rounding

MOST_PROBLEMS = 5  # in words


def conformance(base: str, glb: bytes, source: Source) -> Iterator[ConformanceRow]:
    """A row for each deliverable that there is a standard for, as it is done.

    Args:
        glb: scene.glb.
        source: of what was read of it.
    """
    scene = source.scene
    yield _of_gltf(base, {"scene.glb": glb})
    yield _of_gltf(base, {"scene.web.glb": source.web_glb})
    yield _of_gltf(base, write_lq_glb(scene, source.provenance))
    yield _of_gltf(base, write_gltf(scene, source.provenance))
    for form in get_args(Form):
        yield _of_usd(base, f"scene.{form}", write_usd(scene, form))
    yield _of_usd(base, "scene.quicklook.usdz", write_quicklook(scene), suppress=False)
    for axes in get_args(Axes):
        yield _of_mobilenerf(base, scene, axes)


def _of_gltf(base: str, files: Mapping[str, bytes]) -> ConformanceRow:
    """Of a .glb, or a .gltf with its files."""
    (name,) = (name for name in files if name.endswith((".glb", ".gltf")))
    with tempfile.TemporaryDirectory() as folder:
        for file, data in files.items():
            (Path(folder) / file).write_bytes(data)
        report: dict[str, Any] = validated_file(Path(folder) / name)
    issues = report["issues"]
    problems = [*messages_of(report, ERROR), *messages_of(report, WARNING)][:MOST_PROBLEMS]
    by = f"Khronos' glTF validator {report['validatorVersion']}"
    return ConformanceRow(base, name, by, issues["numErrors"], issues["numWarnings"], {}, problems)


def _of_usd(base: str, name: str, files: Mapping[str, bytes], suppress: bool = True) -> ConformanceRow:
    with tempfile.TemporaryDirectory() as folder:
        found = findings(files, Path(folder), suppress)
    by = f"UsdValidation {version('usd-core')}, {found.validators} validators"
    problems = [*found.errors, *found.warnings][:MOST_PROBLEMS]
    return ConformanceRow(base, name, by, len(found.errors), len(found.warnings), found.suppressed, problems)


def _of_mobilenerf(base: str, scene: BakedScene, axes: Axes) -> ConformanceRow:
    """Read back: bit for bit, but where a scene with a start camera is turned."""
    turned = axes == "forward" and scene.start_camera is not None
    problems = []
    try:
        (assert_equal_within_rounding if turned else assert_equal)(
            read_mobilenerf(write_mobilenerf(scene, axes), axes), as_kept_by_mobilenerf(scene)
        )
    except AssertionError as error:
        problems.append(" ".join(str(error).split())[:200] or "not equal")
    by = f"read back equal{' within rounding' if turned else ', bit for bit'}"
    return ConformanceRow(base, f"scene.mobilenerf.zip, {axes}", by, len(problems), 0, {}, problems)
